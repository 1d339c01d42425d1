"""Where the Chang–Hicher point ends: accuracy asked for, refusals, opening and closing of the packing."""

import numpy as np
import pytest

import umat
from umat import mandel, status
from umat.chang_hicher.material import CLOSED, contact_forces, mobilised
from umat.lanes import COMPILED
from umat.sands import toyoura

SHEAR = np.array([-0.4, 1.0, -0.5, 0.2, 0.1, 0.3])


def open_stress(material, state):
    """Return 3 p_open G, the stress of an open point."""
    return material.open_pressure * material.reference_pressure * (mandel.IDENTITY + 0.4 * state.fabric)


# --- accuracy --------------------------------------------------------------------------------------------------------


def test_error_falls_in_proportion_to_the_tolerance(material, isotropic_start, rule):
    """One large increment after some shear; the reference is 100 times finer than the finest."""
    tolerances = 10.0 ** -np.arange(2.0, 4.1 if COMPILED else 3.1, 0.25)

    def end(tolerance, increment, old):
        finer = material._replace(tolerance=tolerance, max_evaluations=100_000)
        response = umat.update(finer, rule, increment[None], old)
        assert response.status == 0
        return response

    old = end(1e-3, 1e-3 * SHEAR, isotropic_start(material)).state
    exact = end(tolerances[-1] / 100.0, 2e-3 * SHEAR, old).stress
    found = [end(tolerance, 2e-3 * SHEAR, old) for tolerance in tolerances]
    errors = np.array([mandel.norm(response.stress - exact)[0] for response in found]) / mandel.norm(exact)
    assert np.polyfit(np.log(tolerances), np.log(errors), 1)[0] == pytest.approx(1.0, abs=0.3)
    assert (errors <= tolerances).all()
    assert (errors <= [response.error[0] for response in found]).all()  # the estimate is on the safe side


# --- refusals --------------------------------------------------------------------------------------------------------


def refused(material, rule, increment, old, code):
    """Assert that the last of a batch is refused without a trace, and that its neighbour is not disturbed."""
    response = umat.update(material, rule, np.array([np.zeros(6), increment]), old)
    assert list(response.status) == [status.OK, code]
    assert np.array_equal(response.stress[1], old.stress[1], equal_nan=True)
    for new, before in zip(response.state, old, strict=True):
        assert np.array_equal(new[1], before[1], equal_nan=True)
    assert status.message(code)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_increment_that_is_no_number(material, isotropic_start, rule, bad):
    refused(material, rule, bad * SHEAR, isotropic_start(material, n=2), status.BAD_INPUT)


@pytest.mark.parametrize("name", ["stress", "fabric", "void_ratio", "slip"])
def test_state_that_is_no_number(material, isotropic_start, rule, name):
    old = isotropic_start(material, n=2)
    getattr(old, name)[1] = np.nan
    refused(material, rule, 1e-4 * SHEAR, old, status.BAD_INPUT)


def test_stress_without_pressure(material, isotropic_start, rule):
    old = isotropic_start(material, n=2)
    old.stress[1] = -old.stress[1]
    refused(material, rule, 1e-4 * SHEAR, old, status.BAD_INPUT)


def test_void_ratio_out_of_range(material, isotropic_start, rule):
    refused(material, rule, 0.7 / 3.0 * mandel.IDENTITY, isotropic_start(material, n=2), status.VOID_RATIO_RANGE)
    old = isotropic_start(material, n=2)
    old.void_ratio[1] = 1.7  # no gap: the packing itself
    refused(material, rule, 1e-4 * SHEAR, old, status.VOID_RATIO_RANGE)


def test_gap_may_be_as_wide_as_it_will(material, isotropic_start, rule):
    """The volume of a gap counts in the void ratio, not in the range of the law."""
    response = umat.update(material, rule, -0.5 / 3.0 * mandel.IDENTITY[None], isotropic_start(material))
    assert response.status[0] == status.OK
    assert 0.48 < response.state.gap[0] < 0.5
    assert response.state.void_ratio[0] == pytest.approx(1.8 * np.exp(0.5) - 1.0)
    again = umat.update(material, rule, -0.1 / 3.0 * mandel.IDENTITY[None], response.state)
    np.testing.assert_array_equal(again.stress, response.stress)
    assert np.isfinite(again.tangent).all()
    assert np.isfinite(umat.elastic_tangent(material, again.state)).all()


def test_no_point_works_beyond_its_bound(material, isotropic_start, rule):
    limited = material._replace(max_evaluations=5)
    old = isotropic_start(limited, n=2)
    refused(limited, rule, 5e-3 * SHEAR, old, status.WORK_LIMIT)
    assert umat.update(limited, rule, 5e-3 * SHEAR[None].repeat(2, 0), old).work.max() == 5


def test_impossible_starts_are_refused(material, isotropic_start, rule):
    with pytest.raises(ValueError, match="density of contacts"):
        isotropic_start(material, fabric=[-1.2, 0.6, 0.6, 0.0, 0.0, 0.0])
    with pytest.raises(ValueError, match="void ratio must lie between"):
        isotropic_start(material, void_ratio=2.0)
    with pytest.raises(ValueError, match="outside the domain"):
        umat.initial_state(material, rule, [[100.0, 800.0, 100.0, 0.0, 0.0, 0.0]], void_ratio=0.8)
    with pytest.raises(ValueError, match="outside the domain"):
        umat.initial_state(material, rule, -100.0 * mandel.IDENTITY[None], void_ratio=0.8)
    with pytest.raises(ValueError, match="below 2 times the one at which the packing opens"):
        umat.initial_state(material, rule, 0.015 * mandel.IDENTITY[None], void_ratio=0.8)


def test_the_least_pressure_at_the_start_does_not_depend_on_the_increment(material, rule):
    p = CLOSED * material.open_pressure * material.reference_pressure
    ends = []
    for count in (10, 100):
        state = umat.initial_state(material, rule, p * mandel.IDENTITY[None], void_ratio=0.833)
        for _ in range(count):
            state = umat.update(material, rule, 0.01 / count * SHEAR[None], state).state
        ends.append(mandel.q(state.stress)[0])
    assert ends[0] == pytest.approx(ends[1], rel=2e-3)


@pytest.mark.parametrize("name", ["normal_stiffness", "friction_angle", "reference_pressure", "tolerance"])
def test_impossible_parameters_are_refused(isotropic_start, name):
    with pytest.raises(ValueError, match=name):
        isotropic_start(toyoura()._replace(**{name: 0.0}))
    with pytest.raises(ValueError, match="localisation"):
        isotropic_start(toyoura()._replace(localisation="both"))


# --- opening and closing ---------------------------------------------------------------------------------------------


@pytest.fixture(scope="session")
def opened(material, isotropic_start, rule):
    """A point whose contacts are apart by a gap of some per cent."""
    response = umat.update(material, rule, -0.01 * mandel.IDENTITY[None], isotropic_start(material))
    assert response.status == 0
    return response


def test_gap_opens_at_the_open_pressure(material, opened):
    np.testing.assert_allclose(opened.stress, open_stress(material, opened.state), rtol=1e-12)
    assert mandel.p(opened.stress)[0] == pytest.approx(1e-4 * 101.3)
    assert 0.0 < opened.state.gap[0] < 0.03
    stiffness = umat.elastic_tangent(material, opened.state)[0].max()
    assert opened.tangent[0].max() == pytest.approx(material.open_stiffness * stiffness, rel=0.2)


def test_gap_adds_up(material, rule, opened):
    state, gap = opened.state, opened.state.gap
    for step in (-1e-3, -1e-5, 4e-4):
        response = umat.update(material, rule, step * mandel.IDENTITY[None] + 1e-4 * mandel.deviator(SHEAR), state)
        assert response.status == 0
        gap = gap - 3.0 * step
        np.testing.assert_allclose(response.state.gap, gap, rtol=1e-12)
        np.testing.assert_allclose(response.stress, opened.stress, rtol=1e-12)
        assert np.array_equal(response.state.slip, state.slip)
        state = response.state


def test_gap_closes_continuously(material, rule, opened):
    """Just closed, the stress is that of the open point; the strain beyond the gap alone is felt."""
    gap = opened.state.gap[0]
    beyond = np.array([-1e-9, 1e-12, 1e-10, 1e-8])
    old = type(opened.state)(*(np.repeat(array, len(beyond), axis=0) for array in opened.state))
    response = umat.update(material, rule, ((gap + beyond) / 3.0)[:, None] * mandel.IDENTITY, old)
    assert not response.status.any()
    np.testing.assert_allclose(response.state.gap, np.maximum(-beyond, 0.0), atol=1e-15)
    change = mandel.norm(response.stress - opened.stress) / mandel.norm(opened.stress)
    assert change[0] < 1e-12
    assert (np.diff(change[1:]) > 0.0).all()
    assert change[1] < 1e-6


def test_closing_in_one_step_or_in_two_is_the_same(material, rule, opened):
    gap = opened.state.gap[0]
    whole = (gap + 3e-3) / 3.0 * mandel.IDENTITY[None]
    first = umat.update(material, rule, gap / (gap + 3e-3) * whole, opened.state)
    second = umat.update(material, rule, 3e-3 / (gap + 3e-3) * whole, first.state)
    at_once = umat.update(material, rule, whole, opened.state)
    np.testing.assert_allclose(at_once.stress, second.stress, rtol=5e-3, atol=1e-9)


def test_tangent_of_a_closing_point(material, rule, opened):
    gap, step = opened.state.gap[0], 1e-7
    increment = (gap + 3e-4) / 3.0 * mandel.IDENTITY + 1e-4 * mandel.deviator(SHEAR)
    shift = step * np.concatenate([np.eye(6), -np.eye(6)])
    old = type(opened.state)(*(np.repeat(array, 13, axis=0) for array in opened.state))
    response = umat.update(material, rule, increment + np.concatenate([np.zeros((1, 6)), shift]), old)
    assert not response.status.any()
    difference = (response.stress[1:7] - response.stress[7:]).T / (2.0 * step)
    tangent = response.tangent[0]
    np.testing.assert_allclose(tangent, difference, atol=1e-5 * np.abs(tangent).max())


def test_opening_is_a_small_step(material, isotropic_start, rule):
    """The stress falls with the strain; where the packing opens the step is of the size of the open pressure."""
    n = 400 if COMPILED else 8
    old = isotropic_start(material, n=n, p=1.0)
    amount = np.linspace(0.0, 1.5e-3, n)
    response = umat.update(material, rule, -amount[:, None] * (mandel.IDENTITY + 0.3 * mandel.deviator(SHEAR)), old)
    assert not response.status.any()
    assert response.state.gap[-1] > 0.0 == response.state.gap[0]
    first = np.argmax(response.state.gap > 0.0)
    jump = mandel.norm(response.stress[first] - response.stress[first - 1])
    slide = mandel.norm(response.stress[first - 1] - response.stress[first - 2])
    floor = material.open_pressure * material.reference_pressure
    assert jump < 1.5 * slide + 40.0 * floor
    assert (np.diff(response.state.gap[first:]) > 0.0).all()


def test_contacts_never_pull(material, isotropic_start, rule):
    """Random paths that extend more than they compress: p at least the open pressure, forces push, R < tan φ_p."""
    n = 200 if COMPILED else 8
    material = material._replace(max_evaluations=2000 if COMPILED else 200)
    rng = np.random.default_rng(5)
    state = isotropic_start(material, n=n, p=10.0)
    floor = material.open_pressure * material.reference_pressure
    for _ in range(8 if COMPILED else 3):
        increment = 1e-3 * (rng.normal(size=(n, 6)) - 0.4 * mandel.IDENTITY)
        response = umat.update(material, rule, increment, state)
        assert (mandel.p(response.stress) >= (1.0 - 1e-9) * floor).all()
        state = response.state
        assert (state.gap >= 0.0).all()
        if material.localisation == "rate":  # here the forces are what pushes, σ is not their average
            normal = np.einsum("pai,ai->pa", state.force, rule.normals)
            assert (normal >= -1e-12).all()
        else:
            assert (mandel.principal(state.stress) > 0.0).all()
        if material.localisation == "total":
            force = contact_forces(material, rule, state.stress, state.fabric, state.void_ratio)
            critical = 0.934 - 0.019 * (mandel.p(state.stress) / 101.3) ** 0.7
            normal, ratio = mobilised(material, rule, force)
            assert (normal > 0.0).all()
            limit = critical / state.void_ratio * np.tan(np.radians(27.0))
            assert (ratio < limit[:, None] * (1.0 + 1e-9)).all()
    assert (state.gap > 0.0).any()
    assert (state.gap == 0.0).any()
