"""Contact statistics: identities, recovery of the fabric that normals were drawn from, scatter and rates."""

import numpy as np
import pytest

from umat import mandel
from umat.contact_statistics import (
    anisotropic_state,
    coordination_fabric,
    draw_2d,
    draw_3d,
    fabric_2d,
    fabric_3d,
    intensity_and_direction,
    joint_invariants,
)
from umat.fabric import UniformStrain
from umat.fabric.law import INPUTS
from umat.fabric_history import increment

FABRICS = [np.zeros(6), 0.208 * np.array([-1.0, -1.0, 2.0, 0.0, 0.0, 0.0]) / 6.0**0.5,
           mandel.deviator(np.array([0.5, -0.2, -0.3, 0.25, -0.1, 0.3])),
           0.99 * np.array([2.0, -1.0, -1.0, 0.0, 0.0, 0.0])]  # fmt: skip


@pytest.mark.parametrize("fabric", FABRICS, ids=lambda f: f"{mandel.norm(f):.2f}")
def test_fabric_in_space_is_recovered_within_the_sampling_error(fabric):
    """Twenty samples: the errors, in units of the standard error that the sample itself states, have variance one."""
    scores = []
    for seed in range(20):
        found = fabric_3d(draw_3d(fabric, 4000, seed))
        scores.append((found.tensor - fabric) / found.error)
    assert np.mean(np.square(scores)) == pytest.approx(1.0, abs=0.45)
    assert np.abs(scores).max() < 4.5
    assert np.abs(np.mean(scores, axis=0)).max() < 4.0 / 20.0**0.5


@pytest.mark.parametrize(("intensity", "direction"), [(0.1, 20.0), (0.228, 91.2), (0.202, 152.8), (0.5, 45.0)])
def test_fabric_in_the_plane_is_recovered_within_the_sampling_error(intensity, direction):
    found = [fabric_2d(draw_2d(intensity, direction, 2000, seed)) for seed in range(200)]
    scores = [(one.intensity - intensity) / one.error for one in found]
    assert np.mean(np.square(scores)) == pytest.approx(1.0, abs=0.3)
    turned = [(one.direction - direction + 90.0) % 180.0 - 90.0 for one in found]
    assert np.abs(np.mean(turned)) < 4.0 * np.std(turned) / 200.0**0.5


def test_error_falls_with_the_root_of_the_number():
    fabric = FABRICS[2]
    errors = []
    for count in (1000, 100000):
        gaps = [mandel.norm(fabric_3d(draw_3d(fabric, count, seed)).tensor - fabric) for seed in range(12)]
        errors.append(np.sqrt(np.mean(np.square(gaps))))
    assert errors[0] / errors[1] == pytest.approx(10.0, rel=0.35)


def test_drawn_angles_follow_the_density():
    """χ² of twenty bins of E(θ), one count of freedom less."""
    count, edges = 100000, np.linspace(0.0, 2.0 * np.pi, 21)
    normals = draw_2d(0.3, 30.0, count, 5)
    seen, _ = np.histogram(np.arctan2(normals[:, 1], normals[:, 0]) % (2.0 * np.pi), edges)
    primitive = (edges + 0.3 * np.sin(2.0 * (edges - np.radians(30.0)))) / (2.0 * np.pi)
    expected = count * np.diff(primitive)
    assert (((seen - expected) ** 2) / expected).sum() < 43.8  # 0.1 % of χ² with 19


def test_rate_of_drawn_normals_is_that_of_uniform_strain():
    """Normals that follow a strain change their fabric at the rate of the law, within the sampling error."""
    fabric, normals = FABRICS[2], draw_3d(FABRICS[2], 200000, 7)
    strain = mandel.deviator(np.array([0.4, -0.3, -0.1, 0.2, 0.1, -0.3])) * 1e-4
    moved = [normals @ (np.eye(3) + sign * mandel.to_tensor(strain)) for sign in (1.0, -1.0)]
    rate = 0.5 * (fabric_3d(moved[0]).tensor - fabric_3d(moved[1]).tensor)
    inputs = np.zeros((1, INPUTS))
    inputs[0, :6], inputs[0, 19:25] = fabric, strain
    expected = increment(UniformStrain(), inputs)[0]
    assert np.abs(rate - expected).max() < 0.02 * mandel.norm(expected)


# --- identities of the plane --------------------------------------------------------------------------------------


def test_intensity_is_the_vector_magnitude_and_fits_the_principal_values():
    """[G 4, 5] with the factor that makes them agree: F_1,2 = (1 ± Δ)/2 and Δ = |⟨e^{2iφ}⟩|."""
    normals = draw_2d(0.2, 70.0, 500, 3)
    found = fabric_2d(normals)
    phi = np.arctan2(normals[:, 1], normals[:, 0])
    assert found.intensity == pytest.approx(abs(np.exp(2j * phi).mean()), rel=1e-12)
    values, vectors = np.linalg.eigh(found.tensor)
    np.testing.assert_allclose(values, [0.5 * (1.0 - found.intensity), 0.5 * (1.0 + found.intensity)], rtol=1e-12)
    axis = np.degrees(np.arctan2(vectors[1, 1], vectors[0, 1])) % 180.0
    assert found.direction == pytest.approx(axis, abs=1e-9)


@pytest.mark.parametrize("angle", [0.0, 30.0, 45.0, 60.0, 90.0, 150.0])
def test_anisotropic_state_is_the_intensity_times_a_cosine(angle):
    """A = Δ cos 2ϑ [G 17] with the loading direction diag(1, −1)/√2 [G 16]."""
    c, s, delta = np.cos(np.radians(angle)), np.sin(np.radians(angle)), 0.228
    turn = np.array([[c, -s], [s, c]])
    fabric = turn @ np.diag([0.5 * (1.0 + delta), 0.5 * (1.0 - delta)]) @ turn.T
    assert anisotropic_state(np.diag([300.0, 100.0]), fabric) == pytest.approx(
        delta * np.cos(np.radians(2.0 * angle)), abs=1e-12
    )
    assert intensity_and_direction(fabric) == pytest.approx((delta, angle), abs=1e-9)


@pytest.mark.parametrize("dimension", [2, 3])
def test_joint_invariants_do_not_turn_and_are_sums_over_common_axes(dimension):
    rng = np.random.default_rng(0)
    s, f = rng.uniform(1.0, 2.0, (2, dimension))
    expected = [(s * f).sum(), (s * f**2).sum(), (s**2 * f).sum(), (s**2 * f**2).sum()]
    turn = np.linalg.qr(rng.normal(size=(dimension, dimension)))[0]
    np.testing.assert_allclose(joint_invariants(turn @ np.diag(s) @ turn.T, turn @ np.diag(f) @ turn.T), expected)


def test_coordination_number_and_anisotropy_of_a_packing():
    """Z = 2 N_c/N_p = tr F and A = Z Δ [P 3–5]: a square lattice has Z = 4, A = 0."""
    lattice = np.array([[1.0, 0.0], [0.0, 1.0]] * 50)
    tensor, z, a = coordination_fabric(lattice, 50)
    np.testing.assert_allclose(tensor, 2.0 * np.eye(2), atol=1e-14)
    assert (z, a) == pytest.approx((4.0, 0.0), abs=1e-14)
    normals = draw_2d(0.1, 10.0, 2000, 1)
    _, z, a = coordination_fabric(normals, 1000)
    assert (z, a) == pytest.approx((4.0, 4.0 * fabric_2d(normals).intensity))


def test_one_direction_is_the_largest_anisotropy_and_none_has_no_direction():
    assert fabric_2d([[2.0, 0.0], [-1.0, 0.0]])[1:3] == pytest.approx((1.0, 0.0))
    assert np.isnan(fabric_2d([[1.0, 0.0], [0.0, 1.0]]).direction)
    np.testing.assert_allclose(fabric_3d([[0.0, 0.0, 1.0], [0.0, 0.0, -3.0]]).tensor, 7.5 * np.array(
        [-1.0, -1.0, 2.0, 0.0, 0.0, 0.0]) / 3.0)  # fmt: skip


BAD = [
    (lambda: fabric_3d([[1.0, 0.0]]), "rows of 3 numbers"),
    (lambda: fabric_2d([[1.0, 0.0]]), "two or more"),
    (lambda: fabric_2d([[1.0, 0.0], [0.0, 0.0]]), "contact normal 2 has no length"),
    (lambda: draw_3d(2.5 * np.array([-1.0, -1.0, 2.0, 0.0, 0.0, 0.0]) / 2.0, 10, 0), r"negative \(-0.25\)"),
    (lambda: draw_2d(0.6, 0.0, 10, 0), "between 0 and 0.5"),
]


@pytest.mark.parametrize(("call", "message"), BAD)
def test_what_cannot_be_is_refused(call, message):
    with pytest.raises(ValueError, match=message):
        call()


def test_draws_are_repeated_by_their_seed():
    assert (draw_3d(FABRICS[2], 100, 4) == draw_3d(FABRICS[2], 100, 4)).all()
    assert (draw_2d(0.2, 10.0, 100, 4) != draw_2d(0.2, 10.0, 100, 5)).any()
