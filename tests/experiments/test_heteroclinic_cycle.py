"""The experiment `heteroclinic_cycle`: the graph is the one of the flow."""

from typing import Any

import numpy as np
import pytest

from rigidpend.experiments.heteroclinic_cycle import draw
from rigidpend.mechanics.equations import eq1
from tests.experiments.pages import overlap
from tests.experiments.trees import asked, computed, reference

OTHER = ["problem.A=[2, 1, 1.2]", "problem.r=[3, 1, 0]"]

PUBLISHED = {
    **dict.fromkeys([("2", "2*"), ("4", "4*"), ("1*", "1"), ("3*", "3")], 255),
    ("1", "2"): 1,
    ("1", "4"): 0,
    ("3", "4"): 1,
    ("3", "2"): 0,
    ("2*", "1*"): 0,
    ("2*", "3*"): 1,
    ("4*", "3*"): 0,
    ("4*", "1*"): 1,
}
"""The edges of Fig. 2 and what the text says of their sides."""


@pytest.fixture(scope="module", params=[[], OTHER], ids=["paper", "another body"])
def content(request: pytest.FixtureRequest) -> Any:
    return asked("fig2", *request.param)


@pytest.fixture
def data(content: Any) -> Any:
    return computed(content)


def test_the_edges_are_those_of_the_paper_each_once(data: Any) -> None:
    edges, once = data["edges"], ~data["edges"]["again"]
    pairs = zip(edges["from"][once], edges["to"][once], strict=True)
    found = list(zip(pairs, edges["symbol"][once].tolist(), strict=True))
    assert len(found) == len(PUBLISHED)
    assert dict(found) == PUBLISHED
    starred = np.char.endswith([edges["from"], edges["to"]], "*")
    np.testing.assert_array_equal(edges["J1"], starred)


def test_the_arrows_go_as_the_flow_does(content: Any, data: Any) -> None:
    p, edges = content.problem.body.angles(), data["edges"]
    for x, y in zip(edges["theta1"].T, edges["J1"].T, strict=True):
        free = p._replace(mu=0.0)
        theta1_rate, J1_rate, _, _ = eq1((x.mean(), y.mean(), 0.0, 1.0), free, np)
        assert (x[1] - x[0]) * theta1_rate + (y[1] - y[0]) * J1_rate > 0
        assert np.sign(np.diff(y)[0]) == np.sign(J1_rate) or y[0] == y[1]


@pytest.mark.parametrize(
    ("A", "of_order_one"),
    [("[1e150, 5e149, 7e149]", "[10, 5, 7]"), ("[2e-150, 1e-150, 1.5e-150]", "[2, 1, 1.5]")],
)
def test_any_scale_of_the_moments_is_the_same_body(A: str, of_order_one: str) -> None:
    """Up to the ends of what is accepted."""
    edges = computed(asked("fig2", f"problem.A={A}"))["edges"]
    again = computed(asked("fig2", f"problem.A={of_order_one}"))["edges"]
    np.testing.assert_allclose(edges["theta1"], again["theta1"], rtol=1e-15)


@pytest.mark.parametrize(
    ("A", "apart"), [("[1, 1e-20, 1 - 1e-20/2]", (2, 3)), ("[1, 1/2, 1/2 + 1e-40]", (1, 2))]
)
def test_separatrices_at_one_place_are_joined_there(A: str, apart: tuple[int, int]) -> None:
    """Their turn is of no length, and leaves the window on neither side."""
    edges = computed(asked("fig2", f"problem.A={A}"))["edges"]
    places = dict(zip(edges["from"], edges["theta1"][0], strict=True))
    i, k = map(str, apart)
    for start, end in ((f"{i}*", f"{k}*"), (i, k), (k, i), (f"{k}*", f"{i}*")):
        joins = (edges["from"] == start) & (edges["to"] == end)
        np.testing.assert_array_equal(edges["theta1"][:, joins], places[i])


@pytest.mark.parametrize(
    "A",
    ["[2, 0.1, 1.95]", "[2, 1.499, 1.5]", "[2, 1e-20, 2 - 1e-20]"],
    ids=["near pi", "near 0", "at pi in doubles"],
)
def test_numbers_of_separatrices_stay_apart_where_these_nearly_meet(A: str) -> None:
    """Two are 0.15 and 0.2 radians apart, and the name of their rectangle is upon neither."""
    result = reference("fig2")
    result["data"] = data = computed(asked("fig2", f"problem.A={A}"))
    figure = draw.draw(result)
    figure.draw_without_rendering()
    [axes] = figure.axes
    texts = [text for text in axes.texts if text.get_text()]
    rings = [ring for text in texts if (ring := text.get_bbox_patch())]
    boxes = [ring.get_window_extent() for ring in rings]
    assert len(boxes) == 10
    assert not overlap(boxes)
    names = [text.get_window_extent() for text in texts if "rectangle" in text.get_text()]
    places = axes.transData.transform([(x, 0) for x in data["vertices"]["theta1"]])[:, 0]
    assert len(names) == 2
    assert not any(name.x0 - 2 < x < name.x1 + 2 for name in names for x in places)
