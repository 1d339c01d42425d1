"""What the Chang–Hicher point is whatever it is given: pure, independent of frame, units, batch and threads."""

import numpy as np
import pytest

import umat
from umat import mandel
from umat.chang_hicher.material import contact_forces
from umat.directions import directions, mirrored, rotated
from umat.fabric import Constant, LiDafalias, ZhaoKruyt
from umat.lanes import COMPILED
from umat.sands import SANDS, toyoura
from umat.threads import get_threads

ROTATION = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]


def same(left, right):
    """Return whether two responses are equal to the last bit."""
    arrays = [*left.state, *left._replace(state=0)], [*right.state, *right._replace(state=0)]
    return all(np.array_equal(a, b) for a, b in zip(*arrays, strict=True))


# --- pure ------------------------------------------------------------------------------------------------------------


def test_old_state_and_increment_are_not_touched(regimes):
    before, increment = [np.array(array) for array in regimes.state], np.array(regimes.increment)
    response = regimes.updated()
    assert all(np.array_equal(a, b) for a, b in zip(regimes.state, before, strict=True))
    assert np.array_equal(regimes.increment, increment)
    new = [array for array in response.state if array.size]
    assert not any(np.shares_memory(a, b) for a in new for b in regimes.state)


def test_same_call_has_the_same_answer(regimes):
    once = regimes.updated()
    regimes.updated(-0.3 * regimes.increment)
    assert same(regimes.updated(), once)


@pytest.mark.parametrize("law", [ZhaoKruyt(), Constant(), LiDafalias()])
def test_what_was_computed_before_does_not_matter(law, regimes):
    once = regimes.updated()
    other = regimes.material._replace(law=law)
    strain = np.random.default_rng(5).normal(scale=1e-3, size=regimes.increment.shape)
    umat.update(other, regimes.directions, strain, regimes.state)
    assert same(regimes.updated(), once)


def test_no_strain_changes_nothing(regimes):
    response = regimes.updated(0.0 * regimes.increment)
    np.testing.assert_allclose(response.stress, regimes.state.stress, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(response.state.slip, regimes.state.slip, rtol=1e-9, atol=1e-15)


# --- batches and threads ---------------------------------------------------------------------------------------------


@pytest.fixture
def crowd(regimes):
    """Points of all regimes with strains of all sizes, more than a slice of them."""
    n = 200 if COMPILED else 2
    rng = np.random.default_rng(1)
    old = regimes.repeated(n)
    factor = 10.0 ** rng.uniform(-3.0, 0.3, len(old.stress))
    return old, factor[:, None] * np.repeat(regimes.increment, n, axis=0)


def test_number_of_threads_does_not_matter(regimes, crowd):
    old, increment = crowd
    before, responses = get_threads(), []
    try:
        for n_threads in (1, 2):
            umat.set_threads(n_threads)
            responses.append(umat.update(regimes.material, regimes.directions, increment, old))
    finally:
        umat.set_threads(before)
    assert same(*responses)
    assert not responses[0].status.any()


def test_place_in_the_batch_does_not_matter(regimes, crowd):
    old, increment = crowd
    order = np.random.default_rng(2).permutation(len(increment))
    straight = umat.update(regimes.material, regimes.directions, increment, old)
    shuffled_old = type(old)(*(array[order] for array in old))
    shuffled = umat.update(regimes.material, regimes.directions, increment[order], shuffled_old)
    assert np.array_equal(shuffled.status, straight.status[order])
    error = mandel.norm(shuffled.stress - straight.stress[order]) / mandel.norm(straight.stress[order])
    assert error.max() <= 1e-12


def test_point_alone_does_what_it_does_in_the_batch(regimes):
    together = regimes.updated()
    for k in range(len(regimes.names)):
        alone = type(regimes.state)(*(array[k : k + 1] for array in regimes.state))
        stress = umat.update(regimes.material, regimes.directions, regimes.increment[k : k + 1], alone).stress
        np.testing.assert_allclose(stress, together.stress[k : k + 1], rtol=1e-12, atol=1e-10)


def test_no_points_are_a_batch_too(material, isotropic_start, rule):
    state = isotropic_start(material, n=0)
    assert umat.update(material, rule, np.zeros((0, 6)), state).tangent.shape == (0, 6, 6)


# --- frame and symmetry ----------------------------------------------------------------------------------------------


def test_answer_turns_with_the_frame(regimes):
    turn = mandel.rotation(ROTATION)
    old = regimes.state
    force = old.force @ ROTATION.T
    turned = old._replace(stress=old.stress @ turn.T, fabric=old.fabric @ turn.T, force=np.ascontiguousarray(force))
    rule = rotated(regimes.directions, ROTATION)
    response = umat.update(regimes.material, rule, regimes.increment @ turn.T, turned)
    straight = regimes.updated()
    scale = mandel.norm(straight.stress)[:, None]
    np.testing.assert_allclose(response.stress / scale, straight.stress @ turn.T / scale, atol=1e-9)
    np.testing.assert_allclose(response.state.fabric, straight.state.fabric @ turn.T, atol=1e-9)
    np.testing.assert_allclose(response.state.slip, straight.state.slip, atol=1e-12)


def test_quarter_of_the_directions_is_enough_in_plane_strain(material):
    half = directions("gauss_8x12" if COMPILED else "gauss_4x8")
    stress, increment = np.array([[60.0, 110.0, 75.0, 0, 0, 12.0]]), np.array([[-2e-4, 4e-4, 0, 0, 0, 1e-4]])
    ends = []
    for rule in (half, mirrored(half)):
        state = umat.initial_state(material, rule, stress, void_ratio=0.8, fabric=[-0.05, 0.1, -0.05, 0, 0, 0.05])
        for _ in range(5 if COMPILED else 2):
            response = umat.update(material, rule, increment, state)
            assert response.status == 0
            state = response.state
        ends.append(response)
    size = mandel.norm(ends[0].stress)
    np.testing.assert_allclose(ends[1].stress / size, ends[0].stress / size, atol=1e-12)
    np.testing.assert_allclose(ends[1].state.fabric, ends[0].state.fabric, atol=1e-12)
    plane = np.ix_([0], [0, 1, 2, 5], [0, 1, 2, 5])
    np.testing.assert_allclose(ends[1].tangent[plane] / 1e4, ends[0].tangent[plane] / 1e4, atol=1e-10)


# --- stress average, units -------------------------------------------------------------------------------------------


def test_stress_is_the_average_of_the_forces(regimes):
    """σ = m_V ⟨f l⟩ [ZK 16]: with f = σ G⁻¹ n / c in the total form, c ⟨f n⟩ = σ if and only if ⟨n n⟩ = G."""
    if regimes.material.localisation == "rate":
        pytest.skip("holds in the total form only, see docs")
    state, rule = regimes.updated().state, regimes.directions
    force = contact_forces(regimes.material, rule, state.stress, state.fabric, state.void_ratio)
    crowding = 1.0 + np.einsum("pij,ai,aj->pa", mandel.to_tensor(state.fabric), rule.normals, rule.normals)
    density = 3.0 / (2.0 * np.pi) * (13.28 - 8.0 * state.void_ratio) / (1.0 + state.void_ratio)
    average = np.einsum("a,pa,pai,aj->pij", rule.weights, crowding, force, rule.normals) * density[:, None, None]
    stress = mandel.from_tensor(average) * regimes.material.reference_pressure
    np.testing.assert_allclose(stress, state.stress, atol=1e-10 * np.abs(state.stress).max())


@pytest.mark.parametrize(("newtons", "metres"), [(1.0, 1.0), (1e6, 1.0), (1.0, 1e-3)], ids=["Pa", "MPa", "N and mm"])
def test_units_do_not_matter(regimes, newtons, metres):
    per_kpa = 1e3 * metres**2 / newtons
    sand = toyoura(newtons, metres)
    sand = sand._replace(law=regimes.material.law, localisation=regimes.material.localisation)
    old = regimes.state._replace(stress=regimes.state.stress * per_kpa)
    response, expected = umat.update(sand, regimes.directions, regimes.increment, old), regimes.updated()
    size = mandel.norm(expected.stress)[:, None]
    np.testing.assert_allclose(response.stress / per_kpa / size, expected.stress / size, atol=1e-10)
    size = np.abs(expected.tangent).max(axis=(1, 2), keepdims=True)
    np.testing.assert_allclose(response.tangent / per_kpa / size, expected.tangent / size, atol=1e-9)


# --- state -----------------------------------------------------------------------------------------------------------


def test_a_point_keeps_few_numbers(regimes):
    """At most one double for each direction and 40 more in the total form; three more for each in the rate form."""
    doubles = sum(array[0].size for array in regimes.state)
    n = len(regimes.directions)
    assert doubles <= (n if regimes.material.localisation == "total" else 4 * n) + 40
    assert all(array.dtype == np.float64 and array.flags.c_contiguous for array in regimes.updated().state)


def test_fields_are_those_of_the_definitions(regimes):
    state = regimes.updated().state
    fields = umat.state_fields(regimes.material, state)
    p = mandel.p(state.stress) / 101.3
    np.testing.assert_allclose(fields["state_parameter"], state.void_ratio - 0.934 + 0.019 * p**0.7, atol=1e-12)
    np.testing.assert_allclose(fields["fabric_norm"], mandel.norm(state.fabric))
    values = mandel.principal(state.stress)
    sine = (values[:, 0] - values[:, 2]) / (values[:, 0] + values[:, 2])
    np.testing.assert_allclose(np.sin(np.radians(fields["mobilised_friction"])), sine)
    assert (np.abs(fields["anisotropy"]) <= fields["fabric_norm"] * (1 + 1e-12)).all()
    assert np.array_equal(fields["fabric"], state.fabric)
    assert np.array_equal(fields["void_ratio"], state.void_ratio)


def test_void_ratio_follows_the_volume(regimes):
    expected = (1.0 + regimes.state.void_ratio) * np.exp(-mandel.trace(regimes.increment)) - 1.0
    np.testing.assert_allclose(regimes.updated().state.void_ratio, expected, rtol=1e-13)


def test_fabric_changes_unless_its_law_says_no(regimes):
    change = mandel.norm(regimes.updated().state.fabric - regimes.state.fabric)
    evolving = not isinstance(regimes.material.law, Constant)
    slides = ~np.isin(regimes.names, ["elastic", "unloading"])
    assert (change[slides] > 0.0).all() == evolving
    assert np.abs(change[~slides]).max() < 1e-15
    assert np.abs(mandel.trace(regimes.updated().state.fabric)).max() < 1e-14


@pytest.mark.parametrize("name", SANDS)
def test_presets_shear_like_sand(name, rule):
    sand = SANDS[name]()
    state = umat.initial_state(sand, rule, 100.0 * mandel.IDENTITY[None], void_ratio=0.75)
    response = umat.update(sand, rule, np.array([[-5e-4, 1e-3, -5e-4, 0.0, 0.0, 0.0]]), state)
    assert response.status == 0
    assert 10.0 < mandel.q(response.stress)[0] < 130.0
