"""Measures of the anisotropic critical state theory, and what contacts do by direction: identities and limits."""

import numpy as np
import pytest

import umat
from umat import contacts, mandel, measures, path
from umat.chang_hicher.material import contact_forces
from umat.directions import directions
from umat.fabric import Constant
from umat.lanes import COMPILED
from umat.sands import toyoura

RANDOM = np.random.default_rng(3)
TENSORS = RANDOM.normal(size=(20, 6))
FABRICS = 0.2 * mandel.deviator(RANDOM.normal(size=(20, 6)))
SAND = toyoura()
DEPOSIT = 0.208 / 6.0**0.5 * np.array([-1.0, -1.0, 2.0, 0.0, 0.0, 0.0])


def _turn(vectors: np.ndarray) -> np.ndarray:
    matrix, _ = np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))
    return vectors @ mandel.rotation(matrix * np.sign(np.linalg.det(matrix))).T


INVARIANT = {
    "b": lambda s, f: measures.intermediate(s),
    "A": lambda s, f: measures.anisotropy(f, s),
    "A'": lambda s, f: measures.relative_orientation(f, s),
    "K_F": measures.joint_invariant,
    "F_vM": lambda s, f: measures.von_mises_fabric(f),
    "L1..L4": lambda s, f: np.array(measures.joint_invariants(s, f)),
    "A of the loading direction": lambda s, f: mandel.dot(f, measures.loading_direction(s, 0.75)),
}


@pytest.mark.parametrize("name", INVARIANT)
def test_measures_do_not_depend_on_the_axes(name):
    measure = INVARIANT[name]
    np.testing.assert_allclose(measure(_turn(TENSORS), _turn(FABRICS)), measure(TENSORS, FABRICS), atol=1e-12)


def test_relations_between_measures():
    s = mandel.norm(mandel.deviator(TENSORS))
    a, k = measures.anisotropy(FABRICS, TENSORS), measures.joint_invariant(TENSORS, FABRICS)
    np.testing.assert_allclose(k, s * a, rtol=1e-12)
    np.testing.assert_allclose(a, mandel.norm(FABRICS) * measures.relative_orientation(FABRICS, TENSORS), rtol=1e-12)
    np.testing.assert_allclose(measures.relative_orientation(FABRICS, -FABRICS), -1.0, rtol=1e-12)
    np.testing.assert_allclose(measures.joint_invariants(TENSORS, FABRICS)[0], k, atol=1e-12)  # F has no trace
    np.testing.assert_allclose(measures.von_mises_fabric(FABRICS), mandel.q(FABRICS), rtol=1e-12)


def test_von_mises_fabric_by_components():
    """[K 15] of the tensor components is [K 14]."""
    f = mandel.to_tensor(FABRICS)
    gaps = (f[:, 0, 0] - f[:, 1, 1]) ** 2 + (f[:, 0, 0] - f[:, 2, 2]) ** 2 + (f[:, 1, 1] - f[:, 2, 2]) ** 2
    shears = f[:, 0, 1] ** 2 + f[:, 0, 2] ** 2 + f[:, 1, 2] ** 2
    np.testing.assert_allclose(measures.von_mises_fabric(FABRICS), np.sqrt(0.5 * (gaps + 6 * shears)), rtol=1e-12)


@pytest.mark.parametrize("c", [0.6, 0.75, 0.9])
def test_shape_function_is_as_printed(c):
    """[K 24] as printed, y = sin 3θ = −cos 3θ here; 1 in compression, c in extension."""
    y = np.array([-0.9, -0.4, 0.3, 0.8])
    printed = (np.sqrt((1 + c * c) ** 2 + 4 * c * (1 - c * c) * y) - (1 + c * c)) / (2 * (1 - c) * y)
    np.testing.assert_allclose(measures.shape(-y, c), printed, rtol=1e-12)
    np.testing.assert_allclose(measures.shape([1.0, -1.0], c), [1.0, c], rtol=1e-12)


def test_loading_direction_is_the_gradient():
    def surface(r):
        return mandel.norm(mandel.deviator(r)) / measures.shape(mandel.cos3theta(r), 0.75)

    for s in TENSORS:
        slopes = [(surface(s + 1e-6 * unit) - surface(s - 1e-6 * unit)) / 2e-6 for unit in np.eye(6)]
        np.testing.assert_allclose(measures.loading_direction(s, 0.75), measures.direction(slopes), atol=1e-7)
        np.testing.assert_allclose(measures.loading_direction(s, 1.0), measures.direction(s), atol=1e-12)


def test_dilatancy_state_falls_with_the_anisotropy_of_a_dense_sand():
    """ζ = ψ at A = A_c and where e is above e_lim; a vertical deposit sheared along it is denser in ζ."""
    assert measures.dilatancy_state(0.8, 0.9, 0.48, 0.934, 0.1, 0.48) == pytest.approx(-0.1)
    assert measures.dilatancy_state(0.95, 0.9, 0.1, 0.934, 0.1, 0.48) == pytest.approx(0.05)
    along, across = (measures.dilatancy_state(0.8, 0.9, a, 0.934, 0.1, 0.48) for a in (0.2, -0.2))
    assert along < across
    assert across - along == pytest.approx(0.1 * (0.134 / 0.034) * 0.4 / 0.48)


def test_initial_fabric_is_as_printed():
    assert measures.initial_fabric(0.5, 1.0) == 0.0
    assert measures.initial_fabric(0.46, 0.5) == pytest.approx(3 * 6**0.5 * -0.08 / (0.24 + 0.5 * -1.54))


def test_undefined_measures_are_not_exceptions():
    zero = np.zeros(6)
    assert np.isnan(measures.intermediate(mandel.IDENTITY))
    assert np.isnan(measures.inclination(mandel.IDENTITY))
    assert measures.anisotropy(DEPOSIT, mandel.IDENTITY) == 0.0
    assert measures.relative_orientation(zero, DEPOSIT) == 0.0


@pytest.mark.parametrize("alpha", [0.0, 30.0, -60.0, 90.0])
def test_inclination_and_ratio_of_a_stress_made_with_them(alpha):
    stress = 100.0 * mandel.IDENTITY + 30.0 * path.stress_direction(alpha, 0.3)
    assert measures.inclination(stress) == pytest.approx(alpha, abs=1e-10)
    assert measures.intermediate(stress) == pytest.approx(0.3, abs=1e-12)


@pytest.mark.parametrize("rounding", [-1e-16, 0.0, 1e-16])
def test_a_horizontal_axis_is_not_turned_by_rounding(rounding):
    assert measures.inclination([1.0, 0.0, 0.0, 0.0, rounding, 0.0]) == pytest.approx(90.0, abs=1e-10)


@pytest.mark.parametrize("localisation", ["total", "rate"])
def test_forces_of_contacts_are_linear_in_the_normal(localisation):
    """T n at the normals of the rule is the force that the model has there; ⟨f n⟩ gives the stress back."""
    rule = directions("bazant_oh_37" if COMPILED else "bazant_oh_21")
    sand = SAND._replace(localisation=localisation)
    start = np.array([[100.0, 110.0, 130.0, 5.0, -10.0, 8.0]])
    state = umat.initial_state(sand, rule, start, void_ratio=0.8, fabric=DEPOSIT)
    for _ in range(3):
        state = umat.update(sand, rule, 1e-3 * np.array([[-0.3, -0.2, 0.8, 0.0, 0.2, 0.0]]), state).state
    tensor = contacts.force_tensor(sand, rule, state)
    total = contact_forces(sand, rule, state.stress, state.fabric, state.void_ratio)
    expected = total if localisation == "total" else state.force
    np.testing.assert_allclose(np.einsum("pij,aj->pai", tensor, rule.normals), expected, rtol=1e-9, atol=1e-12)
    normal, friction = contacts.mobilisation(sand, rule, state, rule.normals)
    assert normal[0] @ rule.weights == pytest.approx(1.0, rel=1e-6)
    assert (friction > 0.0).all()


def test_density_of_contacts_has_mean_one_and_the_moment_of_its_fabric():
    """The mean of 4π E is 1, and its second moment gives the fabric back, G = I/3 + 2F/15 [ZK 16]."""
    rule = directions("icosahedral_61")
    density = contacts.density(FABRICS, rule.normals)
    np.testing.assert_allclose(density @ rule.weights, 1.0, atol=1e-12)
    moment = np.einsum("pa,a,ai,aj->pij", density, rule.weights, rule.normals, rule.normals)
    np.testing.assert_allclose(mandel.from_tensor(moment), mandel.IDENTITY / 3 + 2 / 15 * FABRICS, atol=1e-12)


#: law, angles, bounds of the spread; frozen, α = 90° stops at 5 % shear, where no strain meets the conditions
CRITICAL = {
    "evolving": (SAND.law, (0.0, 30.0, 60.0, 90.0), (0.0, 0.03)),
    "frozen": (Constant(), (0.0, 30.0, 75.0), (0.1, 0.2)),
}


@pytest.mark.skipif(not COMPILED, reason="hundreds of steps take the compiler")
@pytest.mark.parametrize("name", CRITICAL)
def test_one_critical_stress_ratio_with_evolving_fabric_and_many_without(name):
    """Undrained, e = 0.82, p0 = 100 kPa, b = 0, total localisation: q/p at 50 % shear for all α (max/min − 1)."""
    law, angles, (least, most) = CRITICAL[name]
    sand, rule = SAND._replace(law=law), directions("gauss_16x20")
    legs = [path.undrained(0.5, alpha) for alpha in angles]
    together = path.Leg(*(np.array(column) for column in zip(*legs, strict=True)))
    start = 100.0 * np.repeat(mandel.IDENTITY[None], len(angles), axis=0)
    state = umat.initial_state(sand, rule, start, void_ratio=0.82, fabric=DEPOSIT)
    history = path.follow(sand, rule, state, together, 100)
    assert (history.reached == 1.0).all()
    eta = mandel.eta(history.stress[-1])
    assert least <= eta.max() / eta.min() - 1.0 < most
