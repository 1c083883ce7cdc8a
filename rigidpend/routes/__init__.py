"""Binary route codes: the sides on which an orbit leaves the periodic orbits that it passes.

`codes` is the entry point, and `cells` that for orbits with parameters of their own. `problem` and
`phases` hold the question, and `start` the initial states. `ladder` has the precisions by which
orbits climb, and is the place to begin; `certainty` has the rule by which a symbol is certain.
`run` integrates the orbits of a call, `mapped` follows them by return maps, and `choice` takes one
or the other, according to the `costs` of both; in `handover` an integration begins an orbit and a
map continues it. `neighbourhood` finds the routes of phases close together beside one reference
orbit, and the phase at which a symbol changes. `herpolhode` samples one orbit.
"""
