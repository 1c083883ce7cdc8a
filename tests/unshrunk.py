"""A plugin of pytest, for runs that ask only whether a property fails: its example stays as it is.

With it a mutant that breaks a property is told in seconds, where shrinking takes a minute.
"""

from hypothesis import Phase, settings

settings.register_profile("unshrunk", phases=(Phase.explicit, Phase.reuse, Phase.generate))
settings.load_profile("unshrunk")
