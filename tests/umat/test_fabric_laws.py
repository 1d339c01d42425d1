"""Fabric evolution laws: what all of them must do, and where two of them must agree.

`LAWS_AND_RESTS` is the table: a new law is a new row, and buys all the tests over `RECORDS`.
"""

from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

import numpy as np
import pytest

from umat import mandel
from umat.fabric import (
    LAWS,
    Constant,
    LiDafalias,
    NematNasser,
    Petalas,
    SunSundaresan,
    TianYao,
    UniformStrain,
    WanGuo,
    WooSalgado,
    Yang,
    Yuan,
    ZhaoKruyt,
    law_named,
)
from umat.fabric.law import INPUTS, SPAN, active_inputs, complex_slope, increments, slope_of
from umat.fabric.yuan import older, shape, shapes
from umat.lanes import LANES

FABRIC, STRESS, PSI, RATIO, STRAIN, PLASTIC = (slice(*SPAN[name]) for name in SPAN)
DRIVES = (RATIO, STRAIN, PLASTIC)
TENSORS = (FABRIC, STRESS, *DRIVES)
COMPRESSION = np.array([-1.0, 2.0, -1.0, 0.0, 0.0, 0.0]) / 6.0**0.5  # unit deviator, along y
EXTENSION = -COMPRESSION


# --- evaluation: lanes are points --------------------------------------------------------------------------------


def evaluate(law: Any, inputs: np.ndarray) -> np.ndarray:
    """Return ΔF (6, LANES) of inputs (31, LANES)."""
    out = np.zeros((6, LANES))
    increments(law, np.ascontiguousarray(inputs).reshape(-1), out.reshape(-1))
    return out


def slope(law: Any, inputs: np.ndarray, how: Callable[..., None] = slope_of) -> np.ndarray:
    """Return dΔF/d inputs (6, 31, LANES)."""
    out = np.zeros((6 * INPUTS, LANES))
    how(law, np.ascontiguousarray(inputs).reshape(-1), out.reshape(-1))
    return out.reshape(6, INPUTS, LANES)


@cache
def _slope_kernel() -> Callable[..., None]:
    from numba import njit

    @njit
    def kernel(law, inputs, out):
        slope_of(law, inputs, out)

    return kernel


def own_slope(law: Any, inputs: np.ndarray) -> np.ndarray:
    """Return the derivative that the compiled stress point uses."""
    return slope(law, inputs, _slope_kernel())


def deviators(rng: np.random.Generator, norm: Any) -> np.ndarray:
    """Return random deviators (6, LANES) of the given norms."""
    vectors = mandel.deviator(rng.normal(size=(LANES, 6)))
    return (vectors / mandel.norm(vectors)[:, None]).T * norm


def sample(seed: int = 0) -> np.ndarray:
    """Return random inputs (31, LANES): any fabric to ‖F‖ = 0.7, any direction, q/p from 0.1 to 1.2."""
    rng = np.random.default_rng(seed)
    inputs = np.zeros((INPUTS, LANES))
    pressure = 10.0 ** rng.uniform(-1.0, 3.0, LANES)
    identity = mandel.IDENTITY[:, None]
    inputs[FABRIC] = deviators(rng, rng.uniform(0.01, 0.7, LANES))
    inputs[STRESS] = pressure * (identity + deviators(rng, rng.uniform(0.1, 1.2, LANES) / 1.5**0.5))
    inputs[PSI] = rng.uniform(-0.2, 0.2, LANES)
    inputs[RATIO] = deviators(rng, 1e-2)
    inputs[STRAIN] = deviators(rng, 1e-2) + rng.normal(0.0, 3e-3, LANES) * identity
    inputs[PLASTIC] = deviators(rng, 8e-3) + rng.normal(0.0, 2e-3, LANES) * identity
    return inputs


def state(fabric: Any, ratio: Any, *, plastic: Any = 0.0, strain: Any = None, change: Any = 0.0) -> np.ndarray:
    """Return inputs (31, LANES) that are the same or given in each lane: F, s/p at p = 100, and what drives."""
    inputs = np.zeros((INPUTS, LANES))
    for part, value in (
        (FABRIC, fabric), (RATIO, change), (PLASTIC, plastic), (STRAIN, plastic if strain is None else strain),
    ):  # fmt: skip
        inputs[part] = _column(value)
    inputs[STRESS] = 100.0 * (mandel.IDENTITY[:, None] + _column(ratio))
    return inputs


def _column(value: Any) -> Any:
    value = np.asarray(value, float)
    return value[:, None] if value.ndim == 1 else value


# --- the table ---------------------------------------------------------------------------------------------------


class Rest(NamedTuple):
    """A critical state in which plastic flow goes on along the unit deviators n (6, LANES) and F stays."""

    fabric: np.ndarray
    ratio: np.ndarray


def along(norm: float, q_p: float = 1.25) -> Callable[[Any, np.ndarray], Rest]:
    """Return the rest F = norm n with s/p along n."""
    return lambda law, n: Rest(norm * n, q_p / 1.5**0.5 * n)


def rest_of_zhao_kruyt(law: ZhaoKruyt, n: np.ndarray) -> Rest:
    cosine = mandel.cos3theta(n.T)
    lode = 2.0 * law.extension / ((1.0 + law.extension) - (1.0 - law.extension) * cosine)
    return Rest(law.critical_fabric / lode * n, law.critical_ratio * lode / 1.5**0.5 * n)


def rest_of_yuan(law: Yuan, n: np.ndarray) -> Rest:
    """F = C_F(θ) η, at a stress direction that is not that of plastic flow."""
    ratio = 0.6 * np.roll(n, 1, axis=1)
    l1, l2, _ = shapes(law)
    sine = -mandel.cos3theta(ratio.T)
    return Rest(law.critical_fabric * shape(l2, sine) / (law.critical_ratio * shape(l1, sine)) * ratio, ratio)


def rest_of_tian_yao(law: TianYao, n: np.ndarray) -> Rest:
    ratio = 0.7 * np.roll(n, 1, axis=1)
    return Rest(-7.5 * law.attraction * ratio, ratio)


#: records that use every parameter, and their critical state; None: the law has none
LAWS_AND_RESTS = [
    (Constant(), along(0.3)),
    (ZhaoKruyt(), rest_of_zhao_kruyt),
    (ZhaoKruyt(h=20.0, m=1.5, critical_fabric=0.6, critical_ratio=1.1, extension=0.9), rest_of_zhao_kruyt),
    (Yuan(), rest_of_yuan),
    (Yuan(0.2, 3.0, 5.0, 0.9, 0.5, 0.7, ratio_shape=0.85, fabric_shape=1.3, creation_shape=1.1), rest_of_yuan),
    (older(Yuan()), rest_of_yuan),
    (WanGuo(), along(0.3)),
    (SunSundaresan(), along(0.48)),
    (SunSundaresan(rate=3.0, decay=-5.0, joint=-2.0), along(0.5)),
    (TianYao(), rest_of_tian_yao),
    (TianYao(printed=1.0), rest_of_tian_yao),
    (WooSalgado(), along(0.48)),
    (WooSalgado(rate=6.0, lode=-0.4, critical_fabric=0.6), along(0.6)),
    (LiDafalias(), along(0.48)),
    (LiDafalias(rate=5.0, decay=0.8, critical_fabric=1.0), along(1.25)),
    (Yang(), along(0.48)),
    (Yang(rate=5.0, dilatancy=0.5, critical_fabric=0.6), along(0.6)),
    (NematNasser(), along(0.48)),
    (NematNasser(rate=3.0, limit=float("inf")), None),
    (Petalas(), along(0.48)),
    (Petalas(rate=2.0, critical_fabric=0.7), along(0.7)),
    (UniformStrain(), None),
    (UniformStrain(share=-0.5), None),
]  # fmt: skip
RECORDS = [law for law, _ in LAWS_AND_RESTS]


def label(value: Any) -> str:
    """Return a readable test id: the record, with its parameters where they are not the defaults."""
    if not hasattr(value, "_field_defaults"):
        return ""
    changed = {key: x for key, x in value._asdict().items() if x != value._field_defaults[key]}
    return type(value).__name__ + "-".join(["", *(f"{key}={x:g}" for key, x in changed.items())])


every = pytest.mark.parametrize("law", RECORDS, ids=label)
every_evolving = pytest.mark.parametrize("law", [law for law in RECORDS if not isinstance(law, Constant)], ids=label)


def test_every_law_is_in_the_table():
    assert {type(law) for law in RECORDS} == set(LAWS.values())


def test_laws_are_named_after_their_files():
    assert law_named("zhao_kruyt") is ZhaoKruyt
    assert LAWS["sun_sundaresan"] is SunSundaresan
    assert len(LAWS) == 12
    with pytest.raises(ValueError, match="no fabric law 'zhao'; there are constant, li_dafalias"):
        law_named("zhao")


# --- what every law must do --------------------------------------------------------------------------------------


@every
def test_increment_is_a_deviator(law):
    change = evaluate(law, sample())
    assert change.shape == (6, LANES)  # Mandel components: symmetric by construction
    assert np.abs(change[:3].sum(axis=0)).max() < 1e-16 + 1e-14 * np.abs(change).max()


@every
def test_increment_turns_with_its_inputs(law):
    inputs, rng = sample(1), np.random.default_rng(1)
    turn = np.linalg.qr(rng.normal(size=(LANES, 3, 3)))[0]  # rotations and reflections
    matrix = mandel.rotation(turn)
    turned = inputs.copy()
    for part in TENSORS:
        turned[part] = np.einsum("lij,jl->il", matrix, inputs[part])
    expected = np.einsum("lij,jl->il", matrix, evaluate(law, inputs))
    np.testing.assert_allclose(evaluate(law, turned), expected, rtol=0.0, atol=1e-14)


@every
def test_nothing_changes_without_a_drive(law):
    inputs = sample(2)
    for part in DRIVES:
        inputs[part] = 0.0
    assert np.abs(evaluate(law, inputs)).max() < 1e-25


@every
def test_increment_is_proportional_to_the_drive(law):
    """Rate-independent: of degree one in the increments of s/p, strain and plastic strain."""
    inputs = sample(3)
    once = evaluate(law, inputs)
    for part in DRIVES:
        inputs[part] *= 7.0
    np.testing.assert_allclose(evaluate(law, inputs), 7.0 * once, rtol=1e-12, atol=1e-15)


@every
def test_unit_of_stress_does_not_matter(law):
    inputs = sample(4)
    expected = evaluate(law, inputs)
    inputs[STRESS] *= 1e6
    np.testing.assert_allclose(evaluate(law, inputs), expected, rtol=1e-12, atol=1e-16)


@every
def test_law_reads_only_what_it_declares(law):
    inputs, other = sample(5), sample(6)
    expected = evaluate(law, inputs)
    for k in set(range(INPUTS)) - set(active_inputs(law)):
        inputs[k] = other[k]
    assert (evaluate(law, inputs) == expected).all()


@every_evolving
def test_slope_is_that_of_central_differences(law):
    inputs = sample(7)
    exact = slope(law, inputs, complex_slope)
    for part in SPAN.values():
        scale = np.linalg.norm(inputs[slice(*part)], axis=0)
        difference = np.zeros((6, part[1] - part[0], LANES))
        for k in range(*part):
            step = 1e-6 * scale
            ahead, behind = inputs.copy(), inputs.copy()
            ahead[k] += step
            behind[k] -= step
            difference[:, k - part[0]] = (evaluate(law, ahead) - evaluate(law, behind)) / (2.0 * step)
        gain = np.linalg.norm(evaluate(law, inputs), axis=0) / scale
        error = np.abs(exact[:, slice(*part)] - difference).max(axis=(0, 1))
        assert (error < 1e-7 * gain + 1e-18).all()


@every_evolving
def test_slope_of_the_stress_point_is_the_complex_step(law):
    """Of zhao_kruyt, which writes its derivative out, and of the dispatch for all others."""
    inputs = sample(8)
    exact = slope(law, inputs, complex_slope)
    for part in SPAN.values():  # in each of the six units of the derivative
        size = np.abs(exact[:, slice(*part)]).max(axis=(0, 1))
        assert (np.abs(own_slope(law, inputs) - exact)[:, slice(*part)] <= 1e-12 * size + 1e-30).all()
    assert np.abs(exact).max() > 0.0


@every_evolving
def test_slope_is_finite_at_rest_without_stress_ratio_or_fabric(law):
    inputs = state(np.zeros(6), np.zeros(6))
    assert np.isfinite(evaluate(law, inputs)).all()
    assert np.isfinite(own_slope(law, inputs)).all()


RESTING = [row for row in LAWS_AND_RESTS if row[1] is not None]
#: those that find their rest by themselves under plastic flow of constant volume, from isotropy
ATTRACTED = [row for row in RESTING if not isinstance(row[0], Constant | WanGuo) and row[0] != TianYao(printed=1.0)]


@pytest.mark.parametrize(("law", "rest"), RESTING, ids=label)
def test_fabric_rests_in_the_critical_state(law, rest):
    """Plastic shear of constant volume along n; s/p and ψ = 0 do not change. The Lode angle is smoothed by 10⁻⁵."""
    n = deviators(np.random.default_rng(9), 1.0)
    fabric, ratio = rest(law, n)
    inputs = state(fabric, ratio, plastic=0.01 * n)
    assert np.abs(evaluate(law, inputs)).max() < 1e-5 * 0.01 * 10.0


@pytest.mark.parametrize(("law", "rest"), ATTRACTED, ids=label)
def test_fabric_finds_the_critical_state(law, rest):
    n = deviators(np.random.default_rng(10), 1.0)
    fabric, ratio = rest(law, n)
    inputs = state(np.zeros(6), ratio, plastic=0.01 * n)
    for _ in range(1200):
        inputs[FABRIC] += evaluate(law, inputs)
    np.testing.assert_allclose(inputs[FABRIC], fabric, rtol=0.0, atol=2e-5)


@pytest.mark.parametrize("law", [record() for record in LAWS.values() if record is not Constant], ids=label)
def test_compression_gathers_normals_about_its_axis(law):
    """By default, from isotropy, with s/p, strain and plastic strain that grow along y."""
    inputs = state(np.zeros(6), 0.5 * COMPRESSION, plastic=0.01 * COMPRESSION, change=0.1 * COMPRESSION)
    change = evaluate(law, inputs)[:, 0]
    np.testing.assert_allclose(change, np.linalg.norm(change) * COMPRESSION, atol=1e-16)
    assert change @ COMPRESSION > 1e-3


# --- where two laws agree ----------------------------------------------------------------------------------------


def coaxial(seed: int = 11) -> np.ndarray:
    """Return inputs with F along the plastic strain rate, of constant volume and the total strain, and ψ = 0."""
    inputs, rng = sample(seed), np.random.default_rng(seed)
    n = deviators(rng, 1.0)
    inputs[FABRIC], inputs[PLASTIC], inputs[PSI] = rng.uniform(-0.6, 0.6, LANES) * n, 8e-3 * n, 0.0
    inputs[STRAIN] = inputs[PLASTIC]
    return inputs


def isochoric(seed: int = 12) -> np.ndarray:
    """Return inputs with plastic strain of constant volume, total strain = plastic strain, and ψ = 0."""
    inputs = sample(seed)
    inputs[PLASTIC] = mandel.deviator(inputs[PLASTIC].T).T
    inputs[STRAIN] = inputs[PLASTIC]
    inputs[PSI] = 0.0
    return inputs


def across(seed: int = 13) -> np.ndarray:
    """Return inputs with F:n = 0."""
    inputs = isochoric(seed)
    n = inputs[PLASTIC] / np.linalg.norm(inputs[PLASTIC], axis=0)
    inputs[FABRIC] -= (inputs[FABRIC] * n).sum(axis=0) * n
    return inputs


def at_one_ratio(seed: int = 14) -> np.ndarray:
    """Return inputs with s/p constant in triaxial compression, ‖s/p‖ = 0.6, plastic flow along it."""
    inputs = isochoric(seed)
    inputs[STRESS] = state(np.zeros(6), 0.6 * COMPRESSION)[STRESS]
    inputs[PLASTIC] = 8e-3 * COMPRESSION[:, None]
    inputs[RATIO] = 0.0
    return inputs


def no_ratio(seed: int = 15) -> np.ndarray:
    """Return inputs at isotropic stress."""
    inputs = isochoric(seed)
    inputs[STRESS] = 100.0 * mandel.IDENTITY[:, None]
    return inputs


def isotropic_fabric(seed: int = 18) -> np.ndarray:
    """Return inputs with F = 0."""
    inputs = sample(seed)
    inputs[FABRIC], inputs[STRAIN] = 0.0, inputs[PLASTIC]
    return inputs


PULL = 0.66 / 0.78  # C_F of Yuan in triaxial compression
LOADING = (1.25**2 + 1.5 * 0.6**2) ** 2 / (1.25 * (2.0 / 3.0) ** 0.5)  # ‖ε̇_q^p‖/Λ̇ of Tian & Yao at ‖s/p‖ = 0.6
SIMPLE = ZhaoKruyt(m=0.0, extension=1.0)  # h (F_c − F:n) ε̇_q^p at ψ = 0
COINCIDENCES = [
    ("with F along n", coaxial, SIMPLE, LiDafalias(rate=10.0)),
    ("at psi = 0", isochoric, SIMPLE._replace(h=7.0), NematNasser(rate=7.0 * 0.48)),
    ("h = 0", sample, ZhaoKruyt(h=0.0), Constant()),
    ("no Lode angle", sample, WooSalgado(rate=6.0, critical_fabric=0.6), LiDafalias(rate=6.0, critical_fabric=0.6)),
    ("isotropic stress", no_ratio, WooSalgado(lode=0.5), LiDafalias()),
    ("triaxial compression", at_one_ratio, WooSalgado(rate=4.0, lode=0.5), LiDafalias(rate=6.0)),
    ("no plastic volume change", isochoric, Yang(), LiDafalias()),
    ("dilatancy off", sample, Yang(rate=3.0, dilatancy=0.0), LiDafalias(rate=3.0)),
    ("F across n", across, Petalas(rate=10.0), LiDafalias()),
    ("nothing fades", isochoric, SunSundaresan(decay=0.0), NematNasser(rate=4.8, limit=float("inf"))),
    ("nothing fades, no decay", sample, NematNasser(rate=4.8, limit=float("inf")), LiDafalias(decay=0.0)),
    ("strain all plastic", isochoric, SunSundaresan(), LiDafalias()),
    ("no migration", sample, Yuan(creation=0.3, creation_growth=0.0, migration=0.0, creation_shape=1.0), WanGuo(0.3)),
    ("one stress ratio", at_one_ratio, Yuan(migration=5.0), LiDafalias(rate=5.0, critical_fabric=0.6 * PULL)),
    ("F along n", coaxial, NematNasser(rate=4.8, limit=0.48), LiDafalias(rate=10.0)),
    ("no fabric yet", isotropic_fabric, UniformStrain(share=2.0), SunSundaresan(rate=6.0, decay=0.0, joint=5.0)),
    ("no fabric yet, decay", isotropic_fabric, SunSundaresan(rate=4.8), LiDafalias()),
    ("no fabric yet, exponential", isotropic_fabric, Petalas(rate=10.0), WooSalgado()),
    ("no creation", at_one_ratio, Yuan(creation=0.0), TianYao(rate=7.6 * LOADING, attraction=-PULL / 7.5)),
    ("same in compression", at_one_ratio, Yuan(), older(Yuan())),
    ("no influence of b", sample, older(Yuan(ratio_shape=0.8)), older(Yuan(ratio_shape=0.8, extension_fabric=9.0))),
]  # fmt: skip


@pytest.mark.parametrize(
    ("inputs", "one", "other"), [row[1:] for row in COINCIDENCES], ids=[row[0] for row in COINCIDENCES]
)
def test_laws_coincide(inputs, one, other):
    given = inputs()
    expected = evaluate(other, given)
    np.testing.assert_allclose(evaluate(one, given), expected, rtol=0.0, atol=1e-5 * np.abs(expected).max() + 1e-18)


@pytest.mark.parametrize("q_p", [0.3, 0.9, 1.6])
def test_tian_yao_is_as_printed_for_its_own_flow_rule(q_p):
    """Contracting below M and dilating above it; the printed form is smoothed about M."""
    inputs, m2 = sample(16), 1.25**2
    n = mandel.deviator(inputs[STRESS].T).T
    n /= np.linalg.norm(n, axis=0)
    inputs[STRESS] = state(np.zeros(6), q_p / 1.5**0.5 * n)[STRESS]
    volume, shear = (m2 - q_p**2) * 1e-2, 2.0 * q_p * 1e-2  # ε̇_v^p : ε̇_d^p
    inputs[PLASTIC] = 1.5**0.5 * shear * n + volume / 3.0 * mandel.IDENTITY[:, None]
    gap, width = m2**2 - q_p**4, 0.1 * m2**2
    smoothed = gap**2 / (gap**2 + width**2)
    np.testing.assert_allclose(
        evaluate(TianYao(printed=1.0), inputs), smoothed * evaluate(TianYao(), inputs), rtol=1e-5
    )


def test_uniform_strain_turns_unit_normals():
    """The rate of (15/2)(⟨nn⟩ − I/3), each normal of the density 1 + F:nn moved by (I + ε) n and made unit again."""
    x, weight = np.polynomial.legendre.leggauss(8)
    phi = 2.0 * np.pi * np.arange(16) / 16.0
    radius = np.sqrt(1.0 - x**2)[:, None]
    normals = np.stack([radius * np.cos(phi), radius * np.sin(phi), x[:, None] + 0.0 * phi], axis=-1).reshape(-1, 3)
    inputs, size = sample(17), 1e-4
    inputs[STRAIN] *= size / 1e-2
    expected = np.zeros((6, LANES))
    for lane in range(8):
        fabric, strain = mandel.to_tensor(inputs[FABRIC, lane]), mandel.to_tensor(inputs[STRAIN, lane])
        density = np.repeat(weight, 16) / 32.0 * (1.0 + np.einsum("ai,ij,aj->a", normals, fabric, normals))
        moments = []
        for sign in (1.0, -1.0):
            moved = normals @ (np.eye(3) + sign * strain)
            moved /= np.linalg.norm(moved, axis=1, keepdims=True)
            moments.append(7.5 * np.einsum("a,ai,aj->ij", density, moved, moved))
        expected[:, lane] = mandel.from_tensor(moments[0] - moments[1]) / 2.0
    np.testing.assert_allclose(evaluate(UniformStrain(), inputs)[:, :8], expected[:, :8], atol=1e-4 * size**2)


# --- single laws -------------------------------------------------------------------------------------------------


def test_shapes_of_yuan_are_those_of_the_source():
    """[Y §3]: l1 = .795, M_ct = .62, l2 = M_Ft/M_Fc; h = 1 in compression (θ_l = −30°), l in extension (+30°)."""
    l1, l2, l3 = shapes(Yuan())
    assert l1 == pytest.approx(0.795, abs=2e-3)
    assert l1 * 0.78 == pytest.approx(0.62, abs=2e-3)
    assert (l2, l3) == pytest.approx((0.77 / 0.66, 1.0 / l1))
    for ratio in (l1, l2, l3):
        assert shape(ratio, -1.0) == pytest.approx(1.0)
        assert shape(ratio, 1.0) == pytest.approx(ratio)


@pytest.mark.parametrize(
    ("direction", "fabric", "ratio"), [(COMPRESSION, 0.66, 0.78), (EXTENSION, 0.77, 0.78 * 3 / 3.78)]
)
def test_yuan_ends_at_the_critical_states_of_its_table(direction, fabric, ratio):
    """M_F and M are √(3/2) times the norms of F and s/p."""
    inputs = state(fabric / 1.5**0.5 * direction, ratio / 1.5**0.5 * direction, plastic=0.01 * direction)
    assert np.abs(evaluate(Yuan(), inputs)).max() < 1e-7


def test_zhao_kruyt_has_a_peak_when_dense():
    """At η > M and ψ < 0 the fabric still grows where ‖F‖ = F_c [ZK Fig 3]."""
    inputs = state(0.48 * COMPRESSION, 1.4 / 1.5**0.5 * COMPRESSION, plastic=0.01 * COMPRESSION)
    inputs[PSI] = -0.1
    assert (evaluate(ZhaoKruyt(), inputs)[1] > 0.0).all()


def test_yang_has_a_peak_when_it_dilates():
    flow = 0.01 * COMPRESSION - 1e-3 * mandel.IDENTITY
    assert (evaluate(Yang(), state(0.48 * COMPRESSION, 0.9 * COMPRESSION, plastic=flow))[1] > 0.0).all()
    assert (evaluate(LiDafalias(), state(0.48 * COMPRESSION, 0.9 * COMPRESSION, plastic=flow))[1] < 1e-9).all()
