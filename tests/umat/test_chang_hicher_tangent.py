"""The tangent of the Chang–Hicher point is the derivative of what was computed, sub-steps included."""

import numpy as np
import pytest

import umat
from tests.umat.regimes import difference_errors, taylor_orders
from umat import mandel


def test_regimes_are_what_they_are_called(regimes):
    response = regimes.updated()
    assert not response.status.any()
    slid = (response.state.slip > regimes.state.slip + 1e-15).mean(axis=1)
    share = dict(zip(regimes.names, slid, strict=True))
    assert share["sliding"] > 0.2
    assert share["elastic"] == share["unloading"] == 0.0
    for name in {"reversed", "mixed", "sub-stepped mixed"} & set(share):
        assert 0.0 < share[name] < 1.0
    fall = dict(zip(regimes.names, mandel.q(response.stress) - mandel.q(regimes.state.stress), strict=True))
    if "softening" in fall:
        assert fall["softening"] < 0.0 < share["softening"]
    assert fall["unloading"] < 0.0
    work = dict(zip(regimes.names, response.work, strict=True))
    assert work["sub-stepped sliding"] > 2 * work["sliding"]


def test_taylor_remainder_is_of_second_order(regimes):
    np.testing.assert_allclose(taylor_orders(regimes), 2.0, atol=0.05, err_msg=", ".join(regimes.names))


def test_tangent_agrees_with_central_differences(regimes):
    np.testing.assert_allclose(difference_errors(regimes), 0.0, atol=1e-6, err_msg=", ".join(regimes.names))


def test_tangent_is_not_symmetric(regimes):
    """Sliding is not associated: the material says so, and it is so."""
    assert not umat.symmetric_tangent(regimes.material)
    tangent = regimes.updated().tangent[regimes.names.index("sliding")]
    assert np.abs(tangent - tangent.T).max() > 1e-3 * np.abs(tangent).max()


@pytest.mark.parametrize("void_ratio", [0.7, 0.9])
def test_tangent_without_fabric_and_sliding_is_elastic(material, isotropic_start, rule, void_ratio):
    """Isotropic stress, F = 0, contacts that slid before: the closed form of `elastic_tangent` is exact."""
    state = isotropic_start(material, void_ratio=void_ratio, fabric=0.0)
    state = state._replace(slip=np.full_like(state.slip, 1e-3))
    increment = -1e-9 * mandel.IDENTITY[None]
    tangent = umat.update(material, rule, increment, state).tangent[0]
    expected = umat.elastic_tangent(material, state)[0]
    np.testing.assert_allclose(tangent, expected, atol=1e-6 * expected.max())


def test_elastic_moduli_of_toyoura(material, isotropic_start):
    """G = 0.67, 6.7, 21, 67 MPa at 100 kPa, e = 0.833 for f_ref = 1, 10⁻², 10⁻³, 10⁻⁴ N: G ∝ 1/√f_ref (model.md §5)."""
    for newtons, expected in ((1.0, 0.67), (1e-2, 6.7), (1e-3, 21.0), (1e-4, 67.0)):
        other = material._replace(reference_force=newtons / 1e3)
        elastic = umat.elastic_tangent(other, isotropic_start(other, p=100.0, void_ratio=0.833, fabric=0.0))[0]
        assert elastic[5, 5] / 2.0 / 1e3 == pytest.approx(expected, rel=0.02)


def test_elastic_moduli_grow_with_the_root_of_the_pressure(material, isotropic_start):
    low = umat.elastic_tangent(material, isotropic_start(material, p=50.0))
    high = umat.elastic_tangent(material, isotropic_start(material, p=200.0))
    # the part from the density of contacts, ∝ σ, acts on the volume alone
    np.testing.assert_allclose(high[:, :, 3:], 2.0 * low[:, :, 3:], rtol=1e-12)
    np.testing.assert_allclose(high[:, 0, 0] - high[:, 0, 1], 2.0 * (low[:, 0, 0] - low[:, 0, 1]), rtol=1e-12)
