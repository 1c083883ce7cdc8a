"""One slip in the config of Fig. 4: what is said of it, with its place, its line and a caret."""

from pathlib import Path

import pytest

from rigidpend.experiments.route_codes.schema import Config
from rigidpend.runs import loading
from tests.config.samples import SMALL, changed, complaint, content, refused, written

SLIPS = r"""
# Written -> instead, ^ before what the caret stands under | place | the message, or a part
A: [2, 1, 1.5] -> A: ^&a [2, 1, 1.5] | problem.A | anchors and aliases are not allowed: write the
r: [1, 1, 0] -> r: ^*a | problem.r | anchors and aliases are not allowed: write the
n_symbols: 15 -> ^mu: 0.002 | problem.mu | given twice, first at PATH:8:3
mu: 0.001 -> mu: ^!!float 0.001 | problem.mu | the tag tag:yaml.org,2002:float is not allowed
numerics: -> ^---\nnumerics: | - | a second document; a config has one
numerics: -> ? ^[a, b]\n: 1\nnumerics: | - | a key must be a plain word
  mu: 0.001 -> ^\tmu: 0.001 | - | any token: write spaces in place of the tab
  mu: 0.001 ->    ^mu: 0.001 | - | lines of one part must begin in one column
right: -> ^5: | problem.arrays.5 | expected a letter (A to Z, a to z), then letters, digits and _
count: 32}\n\nnumerics: -> count: 32\nnumerics^: | - | not YAML: expected ',' or '}', but got ':'
n_symbols: 15 -> ^n_symbls: 15 | problem.n_symbls | unknown key; did you mean n_symbols? (known: A
n_symbols: 15 -> ^zzz: 15 | problem.zzz | unknown key (known: A, r, mu, h0, J1_0, n_symbols, arrays)
numerics: -> ^numeric: | numeric | did you mean numerics? (known: figure, experiment, problem, num
problem:\n  A: [2, 1, 1.5]          # principal -> ^problem:\n  # principal | problem.A | required
right: {start: 3*pi/40, -> ^right: { | problem.arrays.right.start | required
experiment: route_codes -> experiment: ^[a] | experiment | closed_orbits
experiment: route_codes -> experiment: ^null | experiment | required (known: asymptotic_orbits, asy
figure: "4"\nexperiment: route_codes -> ^figure: "4" | experiment | required (known: asymptotic
mu: 0.001 -> mu: ^true | problem.mu | expected a number, such as 0.1, 1e-6, 1/10 or 3*pi/40
mu: 0.001 -> mu: ^null | problem.mu | expected a number, such as 0.1, 1e-6, 1/10 or 3*pi/40
count: 63 -> count: ^6.5 | problem.arrays.left.count | 6.5 is not a whole number
count: 63 -> count: ^0 | problem.arrays.left.count | should be greater than or equal to 1, got '0'
count: 63 -> count: ^1e9 | problem.arrays.left.count | less than or equal to 10000000, got '1e9'
engine: auto -> engine: ^tailor | numerics.engine | taylor or scipy, got 'tailor'; did you mean
tolerance: auto -> tolerance: ^0 | numerics.tolerance | more than 0 and at most 0.01, got 0
tolerance: auto -> tolerance: ^1/2 | numerics.tolerance | more than 0 and at most 0.01, got 1/2
[53, 106, 160] -> ^[64, 53] | numerics.precisions | precisions must ascend, got (64, 53)
[53, 106, 160] -> [^x] | numerics.precisions.0 | 'x' is not
{start: 0, step: 1/10, count: 63} -> ^[0, 63] | problem.arrays.left | expected keys with values
start: 0 -> start: ^1e400 | problem.arrays.left.start | phases beyond 1e+15 cannot be resolved
h0: 1.3342 -> h0: ^tan(pi/2) | problem.h0 | tan(pi/2)
1.5] -> ^1/0] | problem.A.2 | 1/0
mu: 0.001 -> mu: ^0.001#c | problem.mu | '0.001#c' is not a number: a comment begins with a blank
step: 1/10, -> step: ^1e14, | problem.arrays.left.step | phases beyond 1e+15 cannot be resolved
step: 1/10, -> step: ^0, | problem.arrays.left.step | the step 0 makes 63 columns equal in doubles
n_symbols: 15 -> n_symbols: ^1e5000 | problem.n_symbols | is too large
A: [2, 1, 1.5] -> A: ^[2, 1] | problem.A | expected 3 values, got 2
mu: 0.001 -> mu: ^-0.001 | problem.mu | mu >= 0 is broken: mu = -0.001
h0: 1.3342 -> h0: ^0.001 | problem.h0 | h0 > mu is broken: h0 = 0.001, mu = 0.001
J1_0: 1e-8 -> J1_0: ^0.0 | problem.J1_0 | 0 < J1_0 < J2_0 is broken: J1_0 = 0.0
n_symbols: 15 -> n_symbols: ^0 | problem.n_symbols | a whole number from 1 to 100000, got 0
"""
CASES = [line for line in SLIPS.splitlines() if line and line[0] != "#"]


@pytest.mark.parametrize("case", CASES)
def test_a_slip_is_said_where_it_stands(tmp_path: Path, case: str) -> None:
    slip, place, message = case.split(" | ")
    old, new = slip.replace("\\n", "\n").replace("\\t", "\t").split(" -> ")
    text = changed(old, new)
    at = text.index(new) + new.index("^")
    text = text[:at] + text[at + 1 :]
    message = message.replace("PATH", str(tmp_path / "given.yaml"))
    path = written(tmp_path, text)
    [problem] = refused(path)
    assert str(problem) == complaint(path, text, at, place.strip("-"), problem.message)
    assert message in problem.message


@pytest.mark.parametrize("name", ["'a b'", "1", "''", "../x", "x" * 41])
def test_an_array_s_name_must_be_a_short_word(tmp_path: Path, name: str) -> None:
    [problem] = refused(written(tmp_path, changed("only:", f"{name}:", SMALL)))
    assert problem.origin.line == 12
    assert problem.place[:2] == ("problem", "arrays")
    assert problem.message.startswith("expected text of at most 40 characters") == (len(name) > 40)


def test_a_step_counts_in_the_finest_precision_and_among_several_columns(tmp_path: Path) -> None:
    fine = SMALL.replace("step: 1/10", "step: -1e-17")
    [problem] = refused(written(tmp_path, fine))
    said = "the step -1e-17 makes 5 columns equal in 53 bits: take a larger one"
    assert (problem.message, problem.place[-1]) == (said, "step")
    assert loading.load(written(tmp_path, fine.replace("[53]", "[53, 106]")))
    alone = SMALL.replace("step: 1/10, count: 5", "step: 0, count: 1")
    assert loading.load(written(tmp_path, alone))


def test_limits_that_the_paper_admits_and_comments_are_admitted(tmp_path: Path) -> None:
    flat = changed("A: [2, 1, 1.5]", "A: [2, 0.2, 1.8] #c")
    still = changed("mu: 0.001", "mu: 0 #c", changed("r: [1, 1, 0]", "r: [0, 1, 0]", flat))
    assert content(Config, written(tmp_path, still)).problem.body.special_cases == ("flat",)
