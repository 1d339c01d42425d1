"""Element tests: the conditions of a leg are met, whatever the material; known answers of simple ones."""

import numpy as np
import pytest

import umat
from umat import mandel, path
from umat.directions import directions
from umat.elastic import Elastic, bulk_modulus, shear_modulus
from umat.lanes import COMPILED
from umat.sands import toyoura

ELASTIC = Elastic(youngs_modulus=30e3, poisson_ratio=0.2)
RULE = directions("bazant_oh_21")
SAND = toyoura()._replace(tolerance=1e-2)
START = np.array([[100.0, 100.0, 100.0, 0.0, 0.0, 0.0]])

#: material, directions, what its initial state needs
MATERIALS = {
    "elastic": (ELASTIC, None, {}),
    "von_mises": (umat.VonMises(30e3, 0.2, 80.0, hardening_modulus=100.0), None, {}),
    "drucker_prager": (umat.DruckerPrager(30e3, 0.2, 1.0, 0.2, strength=10.0), None, {}),
    "mohr_coulomb": (umat.MohrCoulomb(30e3, 0.2, 5.0, 30.0, dilation_angle=5.0), None, {}),
    "chang_hicher": (SAND, RULE, {"void_ratio": 0.8, "fabric": [-0.07, -0.07, 0.14, 0.0, 0.0, 0.0]}),
}
#: leg, names what stays constant
LEGS = {
    "triaxial": path.triaxial(0.01),
    "extension": path.triaxial(-0.005, vertical="y"),
    "undrained": path.undrained(0.01),
    "undrained turned": path.undrained(0.01, alpha=30.0, b=0.4),
    "constant p": path.constant_p(0.01, alpha=70.0, b=0.7, vertical="y", horizontal="z"),
    "isotropic": path.isotropic(40.0),
}
every_leg = pytest.mark.parametrize("leg", LEGS.values(), ids=LEGS)


@pytest.mark.parametrize("name", MATERIALS)
@every_leg
def test_conditions_are_met_in_every_record(name, leg):
    material, rule, needs = MATERIALS[name]
    state = umat.initial_state(material, rule, START, **needs)
    records = 20 if COMPILED else 3
    history = path.follow(material, rule, state, leg, records)
    assert history.reached == 1.0
    assert history.stress.shape == (records + 1, 1, 6)
    change = history.stress[:, 0] - START
    done = change @ leg.on_stress.T + history.strain[:, 0] @ leg.on_strain.T
    scale = np.linalg.norm(leg.on_stress, axis=1) * 100.0 + np.linalg.norm(leg.on_strain, axis=1) * 0.01
    assert np.abs((done - np.outer(history.fraction, leg.value)) / scale).max() < 1e-8
    assert (history.strain[-1] != 0.0).any()


@pytest.mark.parametrize(("alpha", "b"), [(0.0, 0.0), (45.0, 0.0), (30.0, 0.5), (90.0, 1.0)])
def test_axes_and_intermediate_stress_are_held(alpha, b):
    state = umat.initial_state(SAND, RULE, START, void_ratio=0.8, fabric=[-0.07, -0.07, 0.14, 0.0, 0.0, 0.0])
    history = path.follow(SAND, RULE, state, path.undrained(0.02, alpha, b), 10 if COMPILED else 2)
    stress = mandel.to_tensor(history.stress[1:, 0])
    values, axes = np.linalg.eigh(stress)
    np.testing.assert_allclose((values[:, 1] - values[:, 0]) / (values[:, 2] - values[:, 0]), b, atol=1e-6)
    if b < 1.0:  # the axis of σ1 in the x–z plane; at b = 1 it is not unique
        turn = np.degrees(np.arctan2(np.abs(axes[:, 0, 2]), np.abs(axes[:, 2, 2])))
        np.testing.assert_allclose(turn, alpha, atol=1e-6)
    np.testing.assert_allclose(mandel.trace(history.strain), 0.0, atol=1e-15)
    np.testing.assert_allclose(history.void_ratio, 0.8, rtol=1e-14)


def test_drained_triaxial_compression_of_an_elastic_point():
    state = umat.initial_state(ELASTIC, None, START)
    history = path.follow(ELASTIC, None, state, path.triaxial(1e-3, vertical="y"), 4)
    np.testing.assert_allclose(history.stress[-1, 0], START[0] + [0.0, 30.0, 0.0, 0.0, 0.0, 0.0], rtol=1e-12)
    np.testing.assert_allclose(history.strain[-1, 0], [-2e-4, 1e-3, -2e-4, 0.0, 0.0, 0.0], atol=1e-15)
    assert np.isnan(history.void_ratio).all()


def test_shear_at_constant_volume_and_at_constant_p_of_an_elastic_point_are_the_same():
    state = umat.initial_state(ELASTIC, None, START)
    for leg in (path.undrained(1e-3, 30.0, 0.2), path.constant_p(1e-3, 30.0, 0.2)):
        end = path.follow(ELASTIC, None, state, leg, 3)
        values = mandel.principal(end.stress[-1, 0])
        assert values[0] - values[2] == pytest.approx(2.0 * shear_modulus(*ELASTIC) * 1e-3, rel=1e-12)
        assert mandel.p(end.stress[-1, 0]) == pytest.approx(100.0, rel=1e-12)


def test_isotropic_compression_of_an_elastic_point():
    state = umat.initial_state(ELASTIC, None, START)
    end = path.follow(ELASTIC, None, state, path.isotropic(50.0), 3)
    assert mandel.trace(end.strain[-1, 0]) == pytest.approx(50.0 / bulk_modulus(*ELASTIC), rel=1e-12)


def test_given_strain_is_the_update_itself():
    state = umat.initial_state(ELASTIC, None, START)
    strain = np.array([1e-3, 2e-3, -5e-4, 1e-4, 2e-4, 3e-4])
    end = path.follow(ELASTIC, None, state, path.strained(strain), 1)
    np.testing.assert_allclose(end.stress[-1], umat.update(ELASTIC, None, strain[None], state).stress, rtol=1e-12)


def test_mohr_coulomb_ends_at_its_limit():
    """Drained compression: (σ1 − σ3)/(σ1 + σ3) = sin φ without cohesion; dilatancy −ε_v/ε_1 = 2 sin ψ/(1 − sin ψ)."""
    material = umat.MohrCoulomb(30e3, 0.2, cohesion=0.0, friction_angle=30.0, dilation_angle=10.0)
    state = umat.initial_state(material, None, START)
    history = path.follow(material, None, state, path.triaxial(0.05), 50)
    assert history.stress[-1, 0, 2] == pytest.approx(300.0, rel=1e-9)
    volume = mandel.trace(history.strain[-1, 0] - history.strain[-2, 0]) / 1e-3
    sine = np.sin(np.radians(10.0))
    assert volume == pytest.approx(-2.0 * sine / (1.0 - sine), rel=1e-6)


def test_stress_beyond_the_limit_stops_where_it_is_reached():
    material = umat.MohrCoulomb(30e3, 0.2, cohesion=0.0, friction_angle=30.0)
    state = umat.initial_state(material, None, START)
    leg = path.stressed([0.0, 0.0, 400.0, 0.0, 0.0, 0.0])
    history = path.follow(material, None, state, leg, 8)
    assert history.reached == pytest.approx(0.5, abs=1e-3)
    assert np.isnan(history.stress[-1]).all()
    assert history.state.stress[0, 2] == pytest.approx(300.0, abs=0.5)
    assert not np.isnan(history.stress[:4]).any()


def test_batch_does_what_each_point_does_alone():
    legs = [path.triaxial(0.01), path.undrained(0.01, 45.0), path.constant_p(0.005, 20.0, 0.5)]
    together = path.Leg(*(np.array(column) for column in zip(*legs, strict=True)))
    needs = {"void_ratio": 0.85, "fabric": [-0.07, -0.07, 0.14, 0.0, 0.0, 0.0]}
    states = umat.initial_state(SAND, RULE, np.repeat(START, 3, axis=0), **needs)
    records = 5 if COMPILED else 1
    batch = path.follow(SAND, RULE, states, together, records)
    for k, leg in enumerate(legs):
        alone = path.follow(SAND, RULE, umat.initial_state(SAND, RULE, START, **needs), leg, records)
        np.testing.assert_allclose(batch.stress[:, k], alone.stress[:, 0], rtol=1e-9, atol=1e-6)
        np.testing.assert_allclose(batch.fabric[:, k], alone.fabric[:, 0], atol=1e-9)


def test_start_is_not_touched():
    state = umat.initial_state(SAND, RULE, START, void_ratio=0.8)
    before = [np.array(array) for array in state]
    path.follow(SAND, RULE, state, path.triaxial(1e-3), 2)
    assert all((a == b).all() for a, b in zip(state, before, strict=True))


def test_wrong_legs_are_refused():
    state = umat.initial_state(ELASTIC, None, START)
    with pytest.raises(ValueError, match="six conditions"):
        path.follow(ELASTIC, None, state, path.Leg(np.eye(5), np.eye(5), np.ones(5)))
    with pytest.raises(ValueError, match="at least one record"):
        path.follow(ELASTIC, None, state, path.triaxial(0.1), 0)
    with pytest.raises(ValueError, match="are both z"):
        path.undrained(0.1, vertical="z", horizontal="z")


@pytest.mark.skipif(not COMPILED, reason="takes the compiler")
def test_an_undrained_path_ends_where_strain_no_longer_determines_stress():
    """With few directions: the compliance loses a double eigenvalue, the stiffness has a pole, the conditions have not.

    At a limit point of the path their least singular value would vanish, and strain would take the lead.
    """
    sand, rule = toyoura()._replace(tolerance=1e-3), directions("bazant_oh_37")
    deposit = 0.208 / 6.0**0.5 * np.array([-1.0, -1.0, 2.0, 0.0, 0.0, 0.0])
    state = umat.initial_state(sand, rule, START, void_ratio=0.82, fabric=deposit)
    leg = path.undrained(0.5)
    compliance, conditions, before = {}, {}, state
    for moment in path.march(sand, rule, state, leg, 25, path.Controls(error=5e-4, beyond=0.2)):
        elastic = umat.elastic_tangent(sand, moment.state)[0]
        strain = 1e-7 * np.array([[-0.5, -0.5, 1.0, 0.0, 0.0, 0.0]])
        tangent = umat.update(sand, rule, strain, moment.state).tangent[0]
        size = np.where(mandel.norm(leg.on_stress) > 0.0, np.linalg.norm(elastic), 1.0)[:, None]
        compliance[round(moment.fraction[0], 2)] = np.sort(np.linalg.eigvals(np.linalg.inv(tangent) @ elastic).real)
        conditions[round(moment.fraction[0], 2)] = (leg.on_stress @ tangent + leg.on_strain) / size
        before = moment
    assert before.ended == path.REFUSED
    assert before.code == 0  # the material refuses nothing
    assert 0.18 < before.fraction < 0.3
    double = [compliance[place][1:3] for place in (0.08, 0.12, 0.16)]
    assert all(np.ptp(pair) < 1e-3 * pair[0] for pair in double)
    assert double[0][0] > double[1][0] > double[2][0] > 0.0
    assert np.linalg.svd(conditions[0.16], compute_uv=False)[-1] > 0.002
    assert np.linalg.svd(conditions[max(conditions)], compute_uv=False)[-1] > 0.002
    assert double[2][0] < 0.6 * double[0][0]
