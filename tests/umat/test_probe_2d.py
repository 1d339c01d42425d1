"""Laws of the plane: properties, the tables of [P], its reductions, and where two laws are one."""

import numpy as np
import pytest
from scipy.optimize import minimize

from umat import mandel
from umat.fabric.law import INPUTS
from umat.fabric.probe_2d import (
    PLANAR_LAWS,
    REDUCTIONS,
    SAMPLES,
    Probe2D,
    Probe2DByAnisotropy,
    UniformStrain2D,
    anisotropy,
    sample,
)
from umat.fabric_history import Given, evolve, increment

ROOT2 = 2.0**0.5
RECORDS = [*(one.law for one in SAMPLES), Probe2DByAnisotropy(), UniformStrain2D(), UniformStrain2D(-0.5)]
every = pytest.mark.parametrize("law", RECORDS, ids=lambda law: f"{type(law).__name__}-{(*law, '')[0]}")


def inputs(n: int = 50, seed: int = 0) -> np.ndarray:
    """Return random states (n, 31): F with Z about 4, any stress, any strain."""
    rng = np.random.default_rng(seed)
    rows = np.zeros((n, INPUTS))
    rows[:, [0, 1, 5]] = np.array([2.0, 2.0, 0.0]) + rng.normal(0.0, 0.1, (n, 3))
    rows[:, 6:12] = 100.0 * mandel.IDENTITY + rng.normal(0.0, 20.0, (n, 6))
    rows[:, 19:25] = rng.normal(0.0, 1e-3, (n, 6))
    return rows


def probe(law, strain, fabric=(2.0, 2.1, 0.0, 0.0, 0.0, 0.0), stress=(60.0, 140.0, 0.0, 0.0, 0.0, 0.0)) -> np.ndarray:
    rows = np.zeros((len(strain), INPUTS))
    rows[:, :6], rows[:, 6:12], rows[:, 19:25] = fabric, stress, strain
    return increment(law, rows)


def circle(count: int = 72) -> tuple[np.ndarray, np.ndarray]:
    chi = 2.0 * np.pi * np.arange(count) / count
    strain = np.zeros((count, 6))
    strain[:, 0], strain[:, 1] = np.cos(chi), np.sin(chi)
    return chi, strain


# --- properties of every law --------------------------------------------------------------------------------------


@every
def test_increment_stays_in_the_plane(law):
    assert (increment(law, inputs())[:, [2, 3, 4]] == 0.0).all()


@every
def test_what_happens_out_of_the_plane_does_not_matter(law):
    rows, other = inputs(), inputs(seed=1)
    expected = increment(law, rows)
    for first in (0, 6, 19):
        rows[:, first + 2 : first + 5] = other[:, first + 2 : first + 5]
    np.testing.assert_array_equal(increment(law, rows), expected)


@every
@pytest.mark.parametrize("mirror", [1.0, -1.0])
def test_increment_turns_with_its_inputs(law, mirror):
    c, s = np.cos(0.8), np.sin(0.8)
    turn = mandel.rotation(np.array([[c, -s * mirror, 0.0], [s, c * mirror, 0.0], [0.0, 0.0, 1.0]]))
    rows, turned = inputs(), inputs()
    for part in (slice(0, 6), slice(6, 12), slice(19, 25)):
        turned[:, part] = rows[:, part] @ turn.T
    np.testing.assert_allclose(increment(law, turned), increment(law, rows) @ turn.T, atol=1e-13)


@every
def test_increment_is_linear_in_the_strain_and_blind_to_the_unit_of_stress(law):
    """So strain reversal reverses the rate [P §6], and no strain is no rate."""
    rows, more = inputs(), inputs(seed=2)
    once, other = increment(law, rows), increment(law, _with(rows, more))
    both = rows.copy()
    both[:, 19:25] = 2.0 * rows[:, 19:25] - 3.0 * more[:, 19:25]
    both[:, 6:12] *= 1e3
    np.testing.assert_allclose(increment(law, both), 2.0 * once - 3.0 * other, atol=1e-13)


def _with(rows: np.ndarray, more: np.ndarray) -> np.ndarray:
    out = rows.copy()
    out[:, 19:25] = more[:, 19:25]
    return out


def test_a_critical_state_needs_two_parameters_to_vanish():
    """Shear of constant volume along τ changes nothing when d2 = d4 = 0 [P §5.3]; no law of Table 2 is there yet."""
    shear = np.array([[-1.0, 1.0, 0.0, 0.0, 0.0, 0.0]]) / ROOT2
    assert np.abs(probe(Probe2D(d2=0.0, d4=0.0), shear)).max() < 1e-13
    rates = [np.linalg.norm(probe(one.law, shear)) for one in SAMPLES]
    assert rates == sorted(rates, reverse=True)
    assert rates[-1] > 10.0


def test_every_planar_law_is_in_the_table():
    assert {type(law) for law in RECORDS} == set(PLANAR_LAWS.values())


# --- the paper's numbers ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("one", SAMPLES, ids=lambda one: f"{one.stress_ratio}")
def test_rates_of_coordination_and_anisotropy_are_sinusoidal(one):
    """[P 14] for Z; for A with the sign that [P 13] gives to A = F_1 − F_2, y major, opposite to that of [P 14]."""
    d1, d2, d3, d4, _ = one.law
    chi, strain = circle()
    change = probe(one.law, strain)
    expected = (ROOT2 * d1 - d2) * np.cos(chi) + (ROOT2 * d1 + d2) * np.sin(chi)
    np.testing.assert_allclose(change[:, 0] + change[:, 1], expected, atol=1e-12)
    printed = (-ROOT2 * d3 + d4) * np.cos(chi) - (ROOT2 * d3 + d4) * np.sin(chi)
    np.testing.assert_allclose(change[:, 1] - change[:, 0], -printed, atol=1e-12)
    assert (change[:, 1] - change[:, 0])[27] > 0.0  # continued loading, χ = 135°: A grows, as from sample to sample


@pytest.mark.parametrize(("stress_ratio", "printed", "off"), [(0.15, 13.0, 1.0), (0.44, 35.0, 1.0)])
def test_direction_of_the_largest_rate_of_coordination(stress_ratio, printed, off):
    d1, d2, *_ = sample(stress_ratio).law
    assert np.degrees(np.arctan2(ROOT2 * d1 + d2, ROOT2 * d1 - d2)) == pytest.approx(printed, abs=off)


@pytest.mark.parametrize(("stress_ratio", "printed", "off"), [(0.15, 0.004, 0.041), (0.44, 0.28, 0.04)])
def test_asymmetry_of_the_rate_of_anisotropy(stress_ratio, printed, off):
    """b_A/a_A is .044 and .311 of Table 2; the text has .004 (a slip, it seems) and .28."""
    _, _, d3, d4, _ = sample(stress_ratio).law
    assert -(ROOT2 * d3 + d4) / (-ROOT2 * d3 + d4) == pytest.approx(printed, abs=off)


def test_coordination_number_along_the_isobaric_test():
    """Table 2 with the changes of A and e of Table 1 predicts the changes of Z of Table 1, which no fit has seen."""
    fabric = np.array([[2.1265, 2.1755, 0.0, 0.0, 0.0, 0.0]])
    for one, after, off in zip(SAMPLES, SAMPLES[1:], (0.022, 0.020, 0.04), strict=False):
        volume = -(after.void_ratio - one.void_ratio) / (1.0 + one.void_ratio)
        low, high = 0.0, 0.02
        for _ in range(40):  # the shear strain that brings A from sample to sample
            shear = 0.5 * (low + high)
            end = evolve(Probe2DByAnisotropy(), _shear(shear, volume), fabric).fabric[-1]
            low, high = (shear, high) if anisotropy(end)[0] < after.anisotropy else (low, shear)
        gain = float(mandel.trace(end)[0] - mandel.trace(fabric)[0])
        assert gain == pytest.approx(after.coordination - one.coordination, abs=off)
        fabric = end
    assert mandel.trace(fabric)[0] == pytest.approx(3.846, abs=2e-3)


def _shear(shear: float, volume: float) -> Given:
    strain = np.zeros((2, 1, 6))
    strain[1, 0, :2] = 0.5 * volume + np.array([-shear, shear]) / ROOT2
    stress = np.tile(np.array([60.0, 140.0, 0.0, 0.0, 0.0, 0.0]), (2, 1, 1))
    return Given(stress, strain, strain, np.zeros((2, 1)))


def test_a_sample_that_was_not_probed():
    with pytest.raises(ValueError, match=r"at q/p = 0.2; there are 0.15, 0.30, 0.40, 0.44"):
        sample(0.2)


# --- reductions ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("one", SAMPLES, ids=lambda one: f"{one.stress_ratio}")
def test_three_parameters_make_the_ellipse_a_line(one):
    """Of slope (d1 + d3)/(d1 − d3) [P §5.3]."""
    d1, _, d3, _, _ = one.law
    change = probe(REDUCTIONS["three"](one.law), circle()[1])
    # τ̂ has −1 along x here
    np.testing.assert_allclose(change[:, 1] * (d1 - d3), change[:, 0] * (d1 + d3), atol=1e-10)
    assert np.linalg.matrix_rank(probe(one.law, circle()[1])[:, :2]) == 2


@pytest.mark.parametrize("one", SAMPLES, ids=lambda one: f"{one.stress_ratio}")
def test_refitted_reductions_are_the_closest(one):
    strain = circle()[1]
    full = probe(one.law, strain)

    def distance(law: Probe2D) -> float:
        return float(((probe(law, strain) - full) ** 2).sum())

    four = minimize(lambda x: distance(REDUCTIONS["four"](one.law._replace(d3=x[0]))), [0.0])
    three = minimize(lambda x: distance(REDUCTIONS["three"](one.law._replace(d1=x[0], d3=x[1]))), [0.0, 0.0])
    assert distance(REDUCTIONS["four_refitted"](one.law)) == pytest.approx(four.fun, rel=1e-6)
    assert distance(REDUCTIONS["three_refitted"](one.law)) == pytest.approx(three.fun, rel=1e-6)
    assert distance(REDUCTIONS["four_refitted"](one.law)) < distance(REDUCTIONS["four"](one.law))
    assert distance(REDUCTIONS["three_refitted"](one.law)) < distance(REDUCTIONS["three"](one.law))


# --- where two laws are one ---------------------------------------------------------------------------------------


def test_uniform_strain_is_a_probe_law():
    """With F coaxial with stress, 2 sym(F·ε̇) is [P 15] with d1 = Z/√2, d2 = A, d3 = A/√2, d4 = d_ρ = Z."""
    rows = inputs()
    z, a = 4.1, 0.3
    rows[:, :6] = [0.5 * (z - a), 0.5 * (z + a), 0.0, 0.0, 0.0, 0.0]
    rows[:, 6:12] = [70.0, 130.0, 5.0, 0.0, 0.0, 0.0]
    same = Probe2D(z / ROOT2, a, a / ROOT2, z, z)
    np.testing.assert_allclose(increment(UniformStrain2D(), rows), increment(same, rows), atol=1e-15)


@pytest.mark.parametrize("one", SAMPLES, ids=lambda one: f"{one.stress_ratio}")
def test_table_is_read_at_the_anisotropy_of_each_sample(one):
    rows = inputs()
    rows[:, [0, 1, 5]] = 0.5 * (one.coordination + one.anisotropy * np.array([-1.0, 1.0, 0.0])) * [1.0, 1.0, 0.0]
    np.testing.assert_allclose(increment(Probe2DByAnisotropy(), rows), increment(one.law, rows), rtol=1e-11)


def test_uniform_strain_in_the_plane_does_not_keep_the_coordination_number():
    """As [P] says of [P 19]: under volume change the trace moves although no contact is made."""
    squeeze = np.array([[1e-3, 1e-3, 0.0, 0.0, 0.0, 0.0]])
    assert mandel.trace(probe(UniformStrain2D(), squeeze))[0] == pytest.approx(4.1 * 2e-3)
