"""Properties that every reference material must have, over one table of materials.

A row of `MATERIALS` names a material and strain increments, from 100 kPa isotropic, that
take it into each of its regimes.  Stress in kPa.
"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.spatial.transform import Rotation

import umat
from umat import DruckerPrager, Elastic, MohrCoulomb, VonMises, mandel, status, threads

ELASTIC = {"youngs_modulus": 10e3, "poisson_ratio": 0.3}
SMALL = np.array([3e-4, -1e-4, 2e-4, 1e-4, -2e-4, 3e-4])
SHEAR = np.array([1.6e-2, -1.6e-2, -1e-3, 2e-3, -1e-3, 6e-3])
COMPRESSION = np.array([2.0e-2, -9e-3, -9e-3, 1e-4, 2e-4, 1e-4])
EXTENSION = np.array([-2.5e-2, 8e-3, 8e-3, 1e-4, 2e-4, 1e-4])
TENSION = np.array([-4e-2, -3e-2, -3.5e-2, 4e-3, -3e-3, 8e-3])
DIRECTION = np.array([0.4, -0.3, 0.5, 0.4, -0.4, 0.4])

SLIDING = {"shear": SHEAR, "compression": COMPRESSION, "extension": EXTENSION}

MATERIALS = {
    "elastic": (Elastic(**ELASTIC), {}),
    "von_mises": (VonMises(**ELASTIC, yield_stress=60.0, hardening_modulus=500.0), SLIDING),
    "von_mises_perfect": (VonMises(**ELASTIC, yield_stress=60.0), SLIDING),
    "drucker_prager": (DruckerPrager(**ELASTIC, friction_slope=1.0, dilation_slope=0.3, strength=10.0), SLIDING),
    "drucker_prager_hardening": (
        DruckerPrager(**ELASTIC, friction_slope=0.8, dilation_slope=0.0, strength=10.0, hardening_modulus=800.0),
        SLIDING | {"tension": TENSION},
    ),
    "drucker_prager_associated": (
        DruckerPrager(**ELASTIC, friction_slope=0.8, dilation_slope=0.8, strength=10.0),
        SLIDING | {"tension": TENSION},
    ),
    "mohr_coulomb": (MohrCoulomb(**ELASTIC, cohesion=5.0, friction_angle=30.0, dilation_angle=10.0), SLIDING),
    "mohr_coulomb_associated": (
        MohrCoulomb(**ELASTIC, cohesion=5.0, friction_angle=30.0, dilation_angle=30.0),
        SLIDING | {"tension": TENSION},
    ),
    "mohr_coulomb_isochoric": (MohrCoulomb(**ELASTIC, cohesion=0.0, friction_angle=35.0), SLIDING),
    "tresca": (MohrCoulomb(**ELASTIC, cohesion=30.0, friction_angle=0.0), SLIDING),
}

REGIMES = [(name, "elastic", SMALL) for name in MATERIALS] + [
    (name, regime, increment) for name, (_, regimes) in MATERIALS.items() for regime, increment in regimes.items()
]

every_material = pytest.mark.parametrize("material", [row[0] for row in MATERIALS.values()], ids=list(MATERIALS))
every_plastic = pytest.mark.parametrize(
    "material",
    [row[0] for row in MATERIALS.values() if row[1]],
    ids=[name for name, row in MATERIALS.items() if row[1]],
)
every_regime = pytest.mark.parametrize(
    ("material", "increment"),
    [(MATERIALS[name][0], increment) for name, _, increment in REGIMES],
    ids=[f"{name}-{regime}" for name, regime, _ in REGIMES],
)


def isotropic(material, n_points=1, pressure=100.0):
    """Return the state of points under an isotropic pressure."""
    return umat.initial_state(material, None, np.tile(pressure * mandel.IDENTITY, (n_points, 1)))


def scattered(material, n_points=40, seed=0):
    """Return a state reached by strain of many sizes and shapes."""
    random = np.random.default_rng(seed)
    size = 10.0 ** random.uniform(-4, -1.5, (n_points, 1))
    return umat.update(material, None, size * random.normal(size=(n_points, 6)), isotropic(material, n_points)).state


def stress_after(material, old, strain_increments):
    """Return the stress that each of (n, 6) increments leads to from one point."""
    repeated = type(old)(*(np.repeat(field, len(strain_increments), axis=0) for field in old))
    return umat.update(material, None, strain_increments, repeated).stress


# --- the tangent is the derivative of what was computed


@every_regime
def test_taylor_remainder_is_of_second_order(material, increment):
    old = isotropic(material)
    base = umat.update(material, None, increment[None], old)
    steps = 1e-4 * np.linalg.norm(increment) * 2.0 ** -np.arange(5)
    stress = stress_after(material, old, increment + steps[:, None] * DIRECTION)
    remainder = np.linalg.norm(stress - base.stress - np.outer(steps, base.tangent[0] @ DIRECTION), axis=1)
    if remainder[0] < 1e-9 * mandel.norm(stress - base.stress)[0] + 1e-12:
        return  # the response is linear here
    order = np.polyfit(np.log(steps), np.log(remainder), 1)[0]
    assert order == pytest.approx(2.0, abs=0.05)


@every_regime
def test_tangent_agrees_with_central_differences(material, increment):
    old, step = isotropic(material), 1e-6
    forward = stress_after(material, old, increment + step * np.eye(6))
    backward = stress_after(material, old, increment - step * np.eye(6))
    tangent = umat.update(material, None, increment[None], old).tangent[0]
    size = np.abs(umat.elastic_tangent(material, old)).max()
    np.testing.assert_allclose(tangent, (forward - backward).T / (2 * step), atol=1e-6 * size)


@every_material
def test_tangent_is_symmetric_where_the_material_says_so(material):
    increments = np.array([SMALL, SHEAR, COMPRESSION, EXTENSION, TENSION])
    tangent = umat.update(material, None, increments, isotropic(material, len(increments))).tangent
    skew = np.abs(tangent - np.swapaxes(tangent, 1, 2)).max()
    if umat.symmetric_tangent(material):
        assert skew < 1e-10 * np.abs(tangent).max()
    else:
        assert skew > 1e-3 * np.abs(tangent).max()


@every_plastic
def test_increments_of_the_table_reach_their_regimes(material):
    sliding = umat.update(material, None, np.array(list(SLIDING.values())), isotropic(material, 3)).state
    assert (sliding.plastic_strain > 1e-3).all()
    if isinstance(material, MohrCoulomb):
        gaps = -np.diff(mandel.principal(sliding.stress), axis=1) > 1e-9
        assert gaps.tolist() == [[True, True], [True, False], [False, True]]  # face, edge, edge


# --- the update is a pure function of a batch


@every_material
def test_same_call_same_answer_and_old_state_untouched(material):
    old, increment = scattered(material), np.tile(SHEAR, (40, 1))
    before = [field.copy() for field in old]
    first, second = (umat.update(material, None, increment, old) for _ in range(2))
    for field, copy in zip(old, before, strict=True):
        np.testing.assert_array_equal(field, copy)
    np.testing.assert_array_equal(first.stress, second.stress)
    np.testing.assert_array_equal(first.tangent, second.tangent)
    assert not any(np.shares_memory(a, b) for a in first.state for b in old)


@every_material
def test_response_has_the_promised_arrays(material):
    response = umat.update(material, None, np.tile(SHEAR, (40, 1)), scattered(material))
    promised = {"stress": (40, 6), "tangent": (40, 6, 6), "status": (40,), "error": (40,), "work": (40,)}
    for name, shape in promised.items():
        array = getattr(response, name)
        assert array.shape == shape
        assert array.flags.c_contiguous
    assert response.status.dtype == np.int8
    assert response.work.dtype == np.int32
    assert (response.status == status.OK).all()
    np.testing.assert_array_equal(response.state.stress, response.stress)


@every_material
def test_points_do_not_know_of_each_other_nor_of_threads(material, monkeypatch):
    old, increment = scattered(material), np.random.default_rng(1).normal(scale=1e-2, size=(40, 6))
    whole = umat.update(material, None, increment, old)
    alone = type(old)(*(field[7:8] for field in old))
    np.testing.assert_array_equal(umat.update(material, None, increment[7:8], alone).tangent[0], whole.tangent[7])
    monkeypatch.setattr("umat.plastic.SLICE_SIZE", 3)
    before = threads.get_threads()
    for n_threads in (1, 2, 3):
        umat.set_threads(n_threads)
        again = umat.update(material, None, increment, old)
        np.testing.assert_array_equal(again.stress, whole.stress)
        np.testing.assert_array_equal(again.tangent, whole.tangent)
    umat.set_threads(before)


@every_material
def test_no_points_is_no_error(material):
    assert umat.update(material, None, np.empty((0, 6)), isotropic(material, 0)).tangent.shape == (0, 6, 6)


@every_material
@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, 1e305])
def test_bad_input_is_a_status_and_leaves_no_trace(material, bad):
    old = scattered(material, 3)
    increment = np.tile(SHEAR, (3, 1))
    good = umat.update(material, None, increment, old)
    increment[1, 4] = bad
    with np.errstate(all="ignore"):
        response = umat.update(material, None, increment, old)
    assert response.status.tolist() == [status.OK, status.BAD_INPUT, status.OK]
    for new, previous in zip(response.state, old, strict=True):
        np.testing.assert_array_equal(new[1], previous[1])
    np.testing.assert_allclose(response.tangent[1], umat.elastic_tangent(material, old)[1], rtol=1e-12, atol=1e-9)
    np.testing.assert_array_equal(response.stress[[0, 2]], good.stress[[0, 2]])


@every_material
def test_bad_old_stress_is_refused_too(material):
    old = isotropic(material)
    old.stress[0, 2] = np.nan
    assert umat.update(material, None, SMALL[None], old).status[0] == status.BAD_INPUT


# --- mechanics that holds for all of them


@every_material
def test_a_turned_increment_gives_the_turned_answer(material):
    turn = mandel.rotation(Rotation.from_euler("zyx", [0.4, -1.1, 2.0]).as_matrix())
    old, increment = scattered(material), np.random.default_rng(2).normal(scale=1e-2, size=(40, 6))
    straight = umat.update(material, None, increment, old)
    turned = umat.update(material, None, increment @ turn.T, old._replace(stress=old.stress @ turn.T))
    np.testing.assert_allclose(turned.stress, straight.stress @ turn.T, atol=1e-9)
    np.testing.assert_allclose(turned.tangent, turn @ straight.tangent @ turn.T, atol=1e-6)


@every_material
def test_small_strain_is_elastic(material):
    old = isotropic(material)
    response = umat.update(material, None, SMALL[None], old)
    stiffness = umat.elastic_tangent(material, old)[0]
    np.testing.assert_allclose(response.stress[0], old.stress[0] + stiffness @ SMALL, rtol=1e-13)
    np.testing.assert_allclose(response.tangent[0], stiffness, atol=1e-9)


@every_plastic
def test_unloading_is_elastic(material):
    loaded = umat.update(material, None, SHEAR[None], isotropic(material)).state
    assert loaded.plastic_strain[0] > 1e-3
    stiffness = umat.elastic_tangent(material, loaded)[0]
    increment = -0.1 * np.linalg.solve(stiffness, mandel.deviator(loaded.stress[0]))
    unloaded = umat.update(material, None, increment[None], loaded)
    np.testing.assert_allclose(unloaded.stress[0], loaded.stress[0] + stiffness @ increment, rtol=1e-12, atol=1e-10)
    np.testing.assert_array_equal(unloaded.state.plastic_strain, loaded.plastic_strain)


@every_plastic
def test_strength_is_mobilised_in_plastic_flow_and_never_exceeded(material):
    state = scattered(material)
    fields = umat.state_fields(material, state)
    mobilised = fields["mobilised_strength"]
    sliding = (fields["plastic_strain"] > 0) & (mandel.p(state.stress) > 1.0)
    assert 3 < sliding.sum() < 40
    np.testing.assert_allclose(mobilised[sliding], 1.0, rtol=1e-9)
    assert np.nanmax(mobilised[mandel.p(state.stress) > 1.0]) < 1 + 1e-9


@every_material
def test_units_do_not_matter(material):
    stresses = {"youngs_modulus", "yield_stress", "hardening_modulus", "strength", "cohesion"}
    scaled = {name: 1e3 * value if name in stresses else value for name, value in material._asdict().items()}
    in_pascal = type(material)(**scaled)
    increments = np.array([SMALL, SHEAR, COMPRESSION, EXTENSION, TENSION])
    kilo = umat.update(material, None, increments, isotropic(material, 5))
    unit = umat.update(in_pascal, None, increments, isotropic(in_pascal, 5, pressure=100e3))
    np.testing.assert_allclose(unit.stress, 1e3 * kilo.stress, rtol=1e-11, atol=1e-7)
    np.testing.assert_allclose(unit.tangent, 1e3 * kilo.tangent, rtol=1e-9, atol=1e-3)


# --- exact solutions


def driven(material, state, axis, strain, held, stress=100.0, steps=1):
    """Return the state after `strain` along `axis` while the normal stresses `held` keep a value."""
    for _ in range(steps):
        increment = np.zeros((1, 6))
        increment[0, axis] = strain / steps
        increment[0, held] = -strain / steps / len(held)
        for _ in range(40):
            response = umat.update(material, None, increment, state)
            gap = stress - response.stress[0, held]
            if np.abs(gap).max() < 1e-10 * (1 + stress):
                break
            increment[0, held] += np.linalg.lstsq(response.tangent[0][np.ix_(held, held)], gap, rcond=1e-10)[0]
        else:
            pytest.fail("the stresses to be held were not reached")
        state = response.state
    return state


def triaxial(material, axial_strain, pressure=100.0, steps=20):
    """Return the stress (6,) after axial strain along z at constant lateral stress."""
    return driven(material, isotropic(material, 1, pressure), 2, axial_strain, [0, 1], pressure, steps).stress[0]


def test_uniaxial_stress_of_von_mises():
    modulus, yield_stress, hardening = 10e3, 60.0, 500.0
    material = VonMises(modulus, 0.3, yield_stress, hardening)
    for strain in (0.5 * yield_stress / modulus, 0.01, 0.05):
        stress = triaxial(material, strain, pressure=0.0, steps=3)
        plastic = max(0.0, (modulus * strain - yield_stress) / (modulus + hardening))
        np.testing.assert_allclose(stress, [0, 0, modulus * (strain - plastic), 0, 0, 0], atol=1e-8)


@pytest.mark.parametrize(
    ("cohesion", "friction", "dilation"),
    [(10, 0, 0), (0, 30, 0), (10, 30, 0), (0, 30, 10), (10, 30, 10), (0, 40, 40), (10, 40, 40)],
)
def test_triaxial_strength_of_mohr_coulomb(cohesion, friction, dilation):
    material = MohrCoulomb(**ELASTIC, cohesion=cohesion, friction_angle=friction, dilation_angle=dilation)
    ratio = np.tan(np.radians(45 + friction / 2)) ** 2
    compressed = triaxial(material, 0.2)
    extended = triaxial(material, -0.2)
    strength = 2 * cohesion * np.sqrt(ratio)
    np.testing.assert_allclose(compressed[[0, 1, 2]], [100, 100, 100 * ratio + strength], rtol=1e-9)
    np.testing.assert_allclose(extended[[0, 1, 2]], [100, 100, (100 - strength) / ratio], rtol=1e-9)


@pytest.mark.parametrize(("match", "axial_strain"), [("compression", 0.2), ("extension", -0.2)])
def test_drucker_prager_has_the_matched_triaxial_strength(match, axial_strain):
    soil = {"cohesion": 8.0, "friction_angle": 28.0, "dilation_angle": 5.0}
    cone = umat.drucker_prager.matched_to_mohr_coulomb(**ELASTIC, **soil, match=match)
    pyramid = MohrCoulomb(**ELASTIC, **soil)
    stresses = [triaxial(m, axial_strain) for m in (cone, pyramid)]
    np.testing.assert_allclose(*stresses, rtol=1e-8)


@pytest.mark.parametrize("dilation", [0.0, 10.0, 28.0])
def test_drucker_prager_has_the_matched_plane_strain_strength(dilation):
    soil = {"cohesion": 8.0, "friction_angle": 28.0, "dilation_angle": dilation}
    material = umat.drucker_prager.matched_to_mohr_coulomb(**ELASTIC, **soil)
    major, minor = driven(material, isotropic(material), 0, 0.5, held=[1], steps=50).stress[0, :2]
    strength = (major + minor) * np.sin(np.radians(28)) + 2 * 8.0 * np.cos(np.radians(28))
    assert major - minor == pytest.approx(strength, rel=1e-8)


def test_dilation_follows_the_dilation_angle():
    material = MohrCoulomb(**ELASTIC, cohesion=5.0, friction_angle=30.0, dilation_angle=12.0)
    old = isotropic(material)
    new = umat.update(material, None, SHEAR[None], old)
    plastic = SHEAR - np.linalg.solve(umat.elastic_tangent(material, old)[0], new.stress[0] - old.stress[0])
    major, _, minor = mandel.principal(plastic)
    assert -mandel.trace(plastic) / (major - minor) == pytest.approx(np.sin(np.radians(12.0)))


@pytest.mark.parametrize("hardening", [0.0, 800.0])
def test_tension_ends_at_the_apex_of_drucker_prager(hardening):
    material = DruckerPrager(
        **ELASTIC, friction_slope=0.8, dilation_slope=0.3, strength=10.0, hardening_modulus=hardening
    )
    new = umat.update(material, None, TENSION[None], isotropic(material)).state
    plastic = np.sqrt(2 / 3) * mandel.norm(mandel.deviator(TENSION))
    assert new.plastic_strain[0] == pytest.approx(plastic)
    np.testing.assert_allclose(new.stress[0], -(10.0 + hardening * plastic) / 0.8 * mandel.IDENTITY, atol=1e-10)


@pytest.mark.parametrize("dilation", [0.0, 10.0, 30.0])
def test_tension_ends_at_the_apex_of_mohr_coulomb(dilation):
    material = MohrCoulomb(**ELASTIC, cohesion=5.0, friction_angle=30.0, dilation_angle=dilation)
    new = umat.update(material, None, 3 * TENSION[None], isotropic(material))
    np.testing.assert_allclose(new.stress[0], -5.0 / np.tan(np.radians(30)) * mandel.IDENTITY, atol=1e-10)


def test_cone_without_slope_is_von_mises():
    cylinder = VonMises(**ELASTIC, yield_stress=60.0, hardening_modulus=500.0)
    cone = DruckerPrager(**ELASTIC, friction_slope=0.0, dilation_slope=0.0, strength=60.0, hardening_modulus=500.0)
    increments = np.array([SMALL, SHEAR, COMPRESSION, EXTENSION, TENSION])
    first, second = (umat.update(m, None, increments, isotropic(m, 5)) for m in (cylinder, cone))
    np.testing.assert_array_equal(first.stress, second.stress)


ASSOCIATED = {
    "von_mises": VonMises(**ELASTIC, yield_stress=60.0),
    "drucker_prager": DruckerPrager(**ELASTIC, friction_slope=0.8, dilation_slope=0.8, strength=10.0),
    "mohr_coulomb": MohrCoulomb(**ELASTIC, cohesion=5.0, friction_angle=30.0, dilation_angle=30.0),
    "tresca": MohrCoulomb(**ELASTIC, cohesion=30.0, friction_angle=0.0),
}
strains = arrays(float, (5, 6), elements=st.floats(-0.03, 0.03))


@pytest.mark.parametrize("material", ASSOCIATED.values(), ids=ASSOCIATED)
@given(trial=strains, other=strains)
@settings(max_examples=60, deadline=None)
def test_associated_flow_returns_to_the_nearest_point(material, trial, other):
    """(σ_tr − σ) : D⁻¹ : (τ − σ) ≤ 0 for every admissible τ: face, edges and apex at once."""
    old = isotropic(material, 5)
    stiffness = umat.elastic_tangent(material, old)[0]
    stress = umat.update(material, None, trial, old).stress
    admissible = umat.update(material, None, other, old).stress
    plastic_strain = trial - np.linalg.solve(stiffness, (stress - old.stress).T).T
    assert mandel.dot(plastic_strain, admissible - stress).max() < 1e-10


@given(trial=strains, friction=st.floats(5, 45), dilation=st.floats(0.05, 1.0), cohesion=st.floats(0, 20))
@settings(max_examples=60, deadline=None)
def test_mohr_coulomb_flow_is_a_sum_of_the_active_faces(trial, friction, dilation, cohesion):
    from scipy.optimize import nnls

    material = MohrCoulomb(**ELASTIC, cohesion=cohesion, friction_angle=friction, dilation_angle=dilation * friction)
    old = isotropic(material, 5)
    slope, other = (float(np.tan(np.radians(45 + angle / 2)) ** 2) for angle in material[3:])
    strength = 2 * cohesion * np.sqrt(slope)
    pairs = [(i, j) for i in range(3) for j in range(3) if i != j]
    flows = np.zeros((3, 6))
    for column, (i, j) in enumerate(pairs):
        flows[[i, j], column] = 1.0, -other
    for point, stress in enumerate(umat.update(material, None, trial, old).stress):
        trial_stress = old.stress[point] + umat.elastic_tangent(material, old)[0] @ trial[point]
        relaxed = np.linalg.solve(umat.elastic_tangent(material, old)[0], trial_stress - stress)
        flow, principal = mandel.principal(trial_stress), mandel.principal(stress)
        _, axes = np.linalg.eigh(mandel.to_tensor(trial_stress))
        flow = np.einsum("ji,jk,ki->i", axes, mandel.to_tensor(relaxed), axes)[::-1]
        excess = np.array([principal[i] - slope * principal[j] - strength for i, j in pairs])
        assert excess.max() < 1e-9
        active = excess > -1e-9
        residual = nnls(flows[:, active], flow)[1] if active.any() else np.linalg.norm(flow)
        assert residual < 1e-10


# --- refusals


@pytest.mark.parametrize(
    ("material", "name"),
    [
        (Elastic(0.0, 0.3), "youngs_modulus"),
        (Elastic(1.0, 0.5), "poisson_ratio"),
        (VonMises(1.0, 0.3, -1.0), "yield_stress"),
        (VonMises(1.0, 0.3, 1.0, np.nan), "hardening_modulus"),
        (DruckerPrager(1.0, 0.3, -0.1, 0.0, 1.0), "friction_slope"),
        (DruckerPrager(1.0, 0.3, 1.0, 0.0, -1.0), "strength"),
        (MohrCoulomb(1.0, 0.3, -1.0, 30.0), "cohesion"),
        (MohrCoulomb(1.0, 0.3, 1.0, 90.0), "friction_angle"),
        (MohrCoulomb(1.0, 0.3, 1.0, 30.0, 31.0), "dilation_angle"),
    ],
)
def test_impossible_parameter_is_named(material, name):
    with pytest.raises(ValueError, match=name):
        isotropic(material)


@every_material
def test_wrong_shapes_are_refused(material):
    with pytest.raises(ValueError, match=r"strain_increment must have shape \(2, 6\), got \(3, 6\)"):
        umat.update(material, None, np.zeros((3, 6)), isotropic(material, 2))
    with pytest.raises(ValueError, match=r"stress must have shape"):
        umat.initial_state(material, None, np.zeros(6))


def test_unknown_material_is_refused():
    with pytest.raises(TypeError, match=r"str is not a material that umat\.update knows"):
        umat.update("sand", None, np.zeros((1, 6)), None)
