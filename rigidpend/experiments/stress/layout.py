"""Layout of a result of `stress`: claims by kind of trial, and the curves behind them."""

from __future__ import annotations

from rigidpend.experiments.data.layout import Layout
from rigidpend.experiments.stress.trials.fields import (
    DECIDED,
    DRIFT,
    GROWTH,
    OF_CLAIM,
    PENDULUM,
    SPOILT,
)

CURVES: dict[str, Layout] = {
    "passages": {"growth?": GROWTH, "<precisions>": DECIDED},
    "honesty": {"<starts>": SPOILT},
    "long_time": {"pendulum?": PENDULUM, "<methods>": DRIFT},
}
"""Curves behind the claims, by kind of trial; a trial that refuses to compute has none."""

LAYOUT: Layout = {
    **{
        f"{kind}?": {"claims": {f"<claims of {kind}>": OF_CLAIM}, "curves": curves}
        for kind, curves in CURVES.items()
    },
    "<kinds>": {"claims": {"<claims>": OF_CLAIM}, "curves": {}},
}
