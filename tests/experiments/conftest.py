"""Formulas and texts of figures, each set once."""

from collections.abc import Iterator
from typing import Any

import pytest
from matplotlib.mathtext import MathTextParser
from matplotlib.text import Text

from tests.remembered import remembered

SHOWN = ("text", "rotation", "rotation_mode", "ha", "va", "parse_math", "usetex", "wrap")
"""What else than its font a text is set by; its canvas and what follows are asked otherwise."""
LINES = "_multialignment", "_linespacing"


@pytest.fixture(scope="package", autouse=True)
def once() -> Iterator[None]:
    """A formula is set once for all figures, and a text: matplotlib does both again and again."""
    known, set_anew = dict[Any, Any](), vars(Text)["_get_layout"]

    def layout(text: Any, renderer: Any) -> Any:
        shown = [getattr(text, f"get_{name}")() for name in SHOWN]
        shown += [*(vars(text)[name] for name in LINES), hash(text.get_fontproperties())]
        key = (*shown, text.get_figure(root=True).dpi, type(renderer))
        if key not in known:
            known[key] = set_anew(text, renderer)
        return known[key]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(MathTextParser, "parse", remembered(MathTextParser.parse))
        patch.setattr(Text, "_get_layout", layout)
        yield
