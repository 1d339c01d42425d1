"""Laws along given histories: exact solutions, the papers' implicit update, and the stress point's own fabric."""

from typing import Any

import numpy as np
import pytest

import umat
from umat import mandel, path, sands
from umat.chang_hicher.material import critical_void_ratio
from umat.directions import directions
from umat.fabric import (
    LAWS,
    PLANAR_LAWS,
    LiDafalias,
    NematNasser,
    Petalas,
    SunSundaresan,
    UniformStrain,
    WanGuo,
    WooSalgado,
    Yang,
    Yuan,
)
from umat.fabric.yuan import shape, shapes
from umat.fabric_history import Explicit, Given, Implicit, evolve, reads
from umat.plastic_strain import plastic_strain

N = np.array([-1.0, 2.0, -1.0, 0.0, 0.0, 0.0]) / 6.0**0.5  # unit deviator, compression along y
EVERY = [record() for record in (*LAWS.values(), *PLANAR_LAWS.values())]
every = pytest.mark.parametrize("law", EVERY, ids=lambda law: type(law).__name__)


def suited(law: Any, given: Given) -> Given:
    """Return a history of strains that a law of the plane was made for: those of its samples are below .01."""
    return given._replace(strain=0.05 * given.strain) if type(law) in PLANAR_LAWS.values() else given


def straight(records: int = 20, shear: float = 0.2, ratio: float = 0.6, points: int = 1) -> Given:
    """Return plastic shear of constant volume along N, to ‖ε‖ = shear, at a constant ‖s/p‖ and ψ = 0."""
    stress = np.tile(100.0 * (mandel.IDENTITY + ratio * N), (records + 1, points, 1))
    strain = np.linspace(0.0, shear, records + 1)[:, None, None] * np.tile(N, (points, 1))
    return Given(stress, strain, strain.copy(), np.zeros((records + 1, points)))


def winding(records: int = 40, points: int = 3, seed: int = 0) -> Given:
    """Return smooth histories in all six components that turn the axes of stress and strain."""
    rng, t = np.random.default_rng(seed), np.linspace(0.0, 1.0, records + 1)[:, None, None]
    s0, s1, e0, e1 = mandel.deviator(rng.normal(size=(4, points, 6)))
    pressure = 100.0 * (1.0 + 0.3 * np.sin(2.0 * t))
    stress = pressure * (mandel.IDENTITY + 0.25 * np.sin(1.5 * t) * s0 + 0.15 * t**2 * s1)
    strain = 0.05 * t * e0 + 0.03 * np.sin(3.0 * t) * e1 + 0.01 * t * mandel.IDENTITY
    return Given(stress, strain, 0.9 * strain, 0.1 * np.cos(2.0 * t[..., 0]) * np.ones(points))


# --- exact solutions along straight plastic shear: F stays along N -----------------------------------------------

X = np.linspace(0.0, 0.2, 21)
PULL = 0.66 / 0.78 * 0.6  # C_F ‖η‖ of yuan at ‖s/p‖ = 0.6 in triaxial compression

GAIN = 6.0 / 7.0 / 6.0**0.5  # of uniform strain: the deviator of N·N is N/√6


def saturating(end: float, pace: float, start: float = 0.1) -> Any:
    return end + (start - end) * np.exp(-pace * X)


EXACT = [
    (Yuan(), saturating(PULL, 7.6)),
    (LiDafalias(rate=8.0, decay=0.7, critical_fabric=0.5), saturating(0.5 / 0.7, 5.6)),
    (NematNasser(rate=4.0, limit=0.5), saturating(0.5, 8.0)),
    (WooSalgado(rate=5.0, lode=0.4), saturating(0.48, 7.0)),
    (Yang(rate=9.0), saturating(0.48, 9.0)),
    (SunSundaresan(rate=3.0, decay=-6.0), saturating(0.5, 6.0)),
    (SunSundaresan(rate=2.0, decay=0.0, joint=-8.0), 0.5 * np.tanh(4.0 * X + np.arctanh(0.2))),  # x' = 2 − 8x²
    (UniformStrain(), (3.0 + 0.1 * GAIN) / GAIN * np.exp(GAIN * X) - 3.0 / GAIN),  # x' = 3 + GAIN x
]  # fmt: skip


@pytest.mark.parametrize(("law", "expected"), EXACT, ids=lambda value: type(value).__name__)
def test_explicit_update_is_exact_where_a_solution_is_known(law, expected):
    found = evolve(law, straight(), 0.1 * N, Explicit(1e-10))
    assert found.reached == 20
    np.testing.assert_allclose(found.fabric[:, 0], expected[:, None] * N, atol=1e-6 if "stress" in reads(law) else 1e-9)


def test_petalas_is_the_quadrature_of_its_own_rate():
    """Along n, x' = c e^(x/F_c) (F_c − x): the length of shear between two fabrics is the integral of 1/x'."""
    from scipy.integrate import quad

    law = Petalas(rate=2.0, critical_fabric=0.5)
    end = float(evolve(law, straight(), 0.1 * N).fabric[-1, 0] @ N)
    assert quad(lambda x: 1.0 / (2.0 * np.exp(x / 0.5) * (0.5 - x)), 0.1, end)[0] == pytest.approx(0.2, rel=1e-7)


def test_wan_guo_does_not_depend_on_the_way():
    given = winding()
    ratio = mandel.deviator(given.stress) / mandel.p(given.stress)[..., None]
    found = evolve(WanGuo(0.4), given, 0.1 * N)
    np.testing.assert_allclose(found.fabric, 0.1 * N + 0.4 * (ratio - ratio[0]), atol=1e-7)


# --- the implicit update ------------------------------------------------------------------------------------------


def by_hand(law: Yuan, given: Given, fabric: np.ndarray) -> np.ndarray:
    """Return F as [Y 8.3] prints it, F_{n+1} = (C1 h3 (1 + C2‖η‖) Δη + Λ̇ C3 C_F η + F_n) / (1 + C3 Λ̇)."""
    l1, l2, l3 = shapes(law)
    eta = mandel.deviator(given.stress) / mandel.p(given.stress)[..., None]
    out = [np.broadcast_to(fabric, eta[0].shape)]
    for k in range(1, len(eta)):
        size = mandel.norm(eta[k])[:, None]
        sine = -mandel.cos3theta(eta[k])[:, None]
        pull = law.critical_fabric * shape(l2, sine) / (law.critical_ratio * shape(l1, sine))
        made = law.creation * shape(l3, sine) * (1.0 + law.creation_growth * size) * (eta[k] - eta[k - 1])
        moved = law.migration * mandel.norm(mandel.deviator(given.plastic_strain[k] - given.plastic_strain[k - 1]))
        out.append((made + moved[:, None] * pull * eta[k] + out[-1]) / (1.0 + moved[:, None]))
    return np.array(out)


def test_implicit_update_of_yuan_is_that_of_its_paper():
    """To the smoothing of the Lode angle, which fades out below ‖s/p‖ = 10⁻³."""
    given = winding()
    given = given._replace(stress=given.stress + 20.0 * N)
    found = evolve(Yuan(), given, 0.1 * N, Implicit()).fabric
    np.testing.assert_allclose(found, by_hand(Yuan(), given, 0.1 * N), atol=1e-6)


@every
def test_implicit_update_is_of_first_order(law):
    """Records twice as close halve the distance from the explicit answer to the same smooth history."""
    start = np.array([2.1, 2.2, 0.0, 0.0, 0.0, 0.0]) if type(law) in PLANAR_LAWS.values() else 0.1 * N
    gaps = []
    for records in (80, 160):
        given = suited(law, winding(records, seed=3))
        given = given._replace(stress=given.stress + 30.0 * N)
        exact, rough = (evolve(law, given, start, update).fabric[-1] for update in (Explicit(), Implicit()))
        gaps.append(np.abs(exact - rough).max())
    assert gaps[1] < 0.58 * gaps[0] + 1e-7
    assert gaps[0] < 0.2


# --- what every law must do along a history -----------------------------------------------------------------------


@every
def test_evolution_turns_with_the_history(law):
    given, angle = suited(law, winding(20)), 0.7
    if type(law) in PLANAR_LAWS.values():  # about the normal of their plane
        start = np.array([2.1, 2.3, 0.0, 0.0, 0.0, 0.1])
    else:
        start = 0.2 * mandel.deviator(np.array([1.0, 0.0, 0.0, 0.3, -0.2, 0.4]))
    c, s = np.cos(angle), np.sin(angle)
    turn = mandel.rotation(np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]))
    turned = given._replace(**{name: getattr(given, name) @ turn.T for name in ("stress", "strain", "plastic_strain")})
    expected = evolve(law, given, start).fabric @ turn.T
    np.testing.assert_allclose(evolve(law, turned, turn @ start).fabric, expected, atol=1e-6)


@every
def test_nothing_happens_while_nothing_happens(law):
    given = straight(3, shear=0.0)
    start = 0.1 * N
    assert np.abs(evolve(law, given, start).fabric - start).max() < 1e-14


@every
def test_points_do_not_see_each_other(law):
    """More points than a kernel has lanes answer as each one alone."""
    given = suited(law, winding(20, points=70))
    together = evolve(law, given, 0.1 * N, Implicit()).fabric
    assert np.isfinite(together).all()
    for i in (0, 69):
        one = Given(*(array[:, i : i + 1] for array in given))
        np.testing.assert_allclose(evolve(law, one, 0.1 * N, Implicit()).fabric[:, 0], together[:, i], atol=1e-12)


def test_a_history_that_loses_its_pressure_ends_with_a_reason():
    given = straight(10)
    stress = given.stress.copy()
    stress[6:] = np.nan
    found = evolve(Yuan(), given._replace(stress=stress), 0.1 * N)
    assert found.reached == 5
    assert "from record 5 to 6" in found.reason
    assert np.isfinite(found.fabric[:6]).all()
    assert np.isnan(found.fabric[6:]).all()


def test_laws_say_what_they_read():
    assert reads(WanGuo()) == {"ratio"}
    assert reads(LiDafalias()) == {"fabric", "plastic"}
    assert reads(PLANAR_LAWS["probe_2d"]()) == {"fabric", "stress", "strain"}


# --- the stress point and its records -----------------------------------------------------------------------------


@pytest.fixture(scope="module")
def sand() -> Any:
    return sands.toyoura()._replace(tolerance=1e-4), directions("bazant_oh_37")


def walk(sand: Any, legs: list[path.Leg], fabric: np.ndarray, records: int) -> path.History:
    material, rule = sand
    state = umat.initial_state(material, rule, 100.0 * mandel.IDENTITY[None], void_ratio=0.75, fabric=fabric)
    return path.follow(material, rule, state, legs[0], records=records)


def test_isotropic_compression_of_an_isotropic_packing_is_elastic(sand):
    """No contact has a tangential force, so none slides; what is left are the steps of the integration."""
    seen = walk(sand, [path.isotropic(300.0)], np.zeros(6), 40)
    plastic = plastic_strain(*sand, seen.stress, seen.strain, seen.fabric, seen.void_ratio)
    assert mandel.trace(seen.strain[-1, 0]) > 5e-3
    assert np.abs(plastic).max() < 1e-4 * mandel.trace(seen.strain[-1, 0])


@pytest.mark.parametrize(("alpha", "b"), [(0.0, 0.0), (45.0, 0.5)])
def test_the_law_along_a_path_of_the_model_gives_the_fabric_of_the_model(sand, alpha, b):
    """Second order in the distance of the records, in which the plastic strain is found from the contact forces."""
    deposit = 0.208 * mandel.from_tensor(np.diag([-1.0, -1.0, 2.0])) / 6.0**0.5
    gaps = []
    for records in (40, 80):
        seen = walk(sand, [path.constant_p(0.15, alpha, b)], deposit, records)
        plastic = plastic_strain(*sand, seen.stress, seen.strain, seen.fabric, seen.void_ratio)
        psi = seen.void_ratio - critical_void_ratio(sand[0], mandel.p(seen.stress))
        found = evolve(sand[0].law, Given(seen.stress, seen.strain, plastic, psi), seen.fabric[0])
        gaps.append(np.abs(found.fabric - seen.fabric).max())
    assert mandel.norm(seen.fabric[-1, 0] - seen.fabric[0, 0]) > 0.15
    assert gaps[0] < 1e-3
    assert gaps[1] < 0.5 * gaps[0]


def test_plastic_strain_refuses_what_it_cannot_know(sand):
    material, rule = sand
    with pytest.raises(ValueError, match="total form only"):
        plastic_strain(material._replace(localisation="rate"), rule, *[np.zeros((2, 1, 6))] * 3, np.ones((2, 1)))
