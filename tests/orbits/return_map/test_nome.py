"""The nome against Jacobi's functions, and the invariant of a normal form without weight."""

import mpmath
import numpy as np
import pytest

from rigidpend import Body
from rigidpend.orbits.precision import precision
from rigidpend.orbits.return_map.conjugacy import TorusForm
from rigidpend.orbits.return_map.expansions import Interval
from rigidpend.orbits.return_map.nome import free_rate, normalization
from rigidpend.orbits.return_map.normal_form import normal_form
from rigidpend.orbits.return_map.reduced import coefficients
from tests.bodies import FIG4

A, H = precision(53), 1.3342
BODIES = [Body(FIG4.A, FIG4.r, 0), Body((2.099, 0.135, 1.993), (1, 1, 0), 0)]


def free_motion(body: Body, product: float) -> tuple[float, float, float]:
    """The nome, lambda and lambda_0 (1/t') of the motion without weight with a given Qp Qm."""
    p = body.angles()
    cos2, sin2 = (float(x(p.alpha0 / 2)) ** 2 for x in (mpmath.cos, mpmath.sin))
    # M1^2 where it is largest, on M3 = 0; along M2 = 0 it is Qp Qm/cos^2.
    largest = (2 * H + product) / float(p.kappa) * sin2 + product
    parameter = product / cos2 / largest
    K, of_complement = mpmath.ellipk(1 - parameter), mpmath.ellipk(parameter)
    # Where Qp Qm < 0, K has the imaginary part K', which makes the nome negative.
    nome = mpmath.exp(-mpmath.pi * K / of_complement)
    rate = np.pi * np.sqrt(largest * cos2) / (2 * float(of_complement))
    return float(nome.real), rate, np.sqrt(2 * H / float(p.kappa) * sin2 * cos2)


@pytest.mark.parametrize("product", [1e-6, 0.003, 0.01, -0.01])
@pytest.mark.parametrize("body", BODIES)
def test_the_rate_as_a_series_in_the_nome_is_that_of_jacobis_functions(
    body: Body, product: float
) -> None:
    c, (q, rate, rate_0) = coefficients(body.angles(), "1", A), free_motion(body, product)
    powers, scale = q ** np.arange(60), (16 * rate_0**2) ** np.arange(60.0)
    assert free_rate(c, 60) @ powers == pytest.approx(rate / rate_0, rel=1e-13, abs=0)
    f = normalization(c, H, 60)
    assert f[0] == 1
    assert (f * scale) @ powers == pytest.approx(rate / rate_0 / (1 - q * q), rel=1e-13, abs=0)
    np.testing.assert_array_equal(normalization(c, H, 5), f[:5])


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("body", BODIES)
def test_the_invariant_without_weight_is_the_nome_but_for_terms_of_third_order(
    body: Body, side: int
) -> None:
    """With 1 instead of f it would differ in the first order."""
    c, off = coefficients(body.angles(), "1", A), []
    form = TorusForm(normal_form(c, Interval(H, 0.0, 1), 41, 1, 0.1, A), np.array([H]), A)
    for product in (0.004, 0.008):
        q, _, rate_0 = free_motion(body, side * product)
        Qp = np.sqrt(product) * np.exp([-0.5, 0.0, 0.7])
        at = form.inverted(np.array([0.3, 1.0, 2.0]), Qp, side * product / Qp)
        off.append(np.abs(at.u * at.v / (16 * rate_0**2 * q) - 1).max() / abs(q) ** 3)
    assert off[1] == pytest.approx(off[0], rel=0.1)
    assert max(off) < 3
