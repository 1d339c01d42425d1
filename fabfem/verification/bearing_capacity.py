"""Strip footings on associated Mohr–Coulomb ground: the three factors of bearing capacity, each alone.

Nc and Nq are exact for weightless ground, smooth and rough [Prandtl 1920, Reissner 1924]; Nγ, for ground without
cohesion or surcharge, comes from the method of characteristics, whose field is the exact one [Martin 2005], in the
convention q_u = γ B Nγ / 2. Displacement elements approach from above, in proportion to the size of the elements at the
footing's edge; the ground at rest has K0 = 1, which a limit load does not depend on.
"""

from collections.abc import Iterator

import numpy as np

from fabfem.verification.ground import Ground, footing, settled
from fabfem.verification.row import Row
from fabfem.verification.scene import Answer, solve

NGAMMA = {
    10: (0.2809, 0.4332),
    20: (1.5786, 2.8389),
    30: (7.6530, 14.754),
    35: (17.577, 34.476),
    40: (43.187, 85.565),
}
"""Angle of friction [degrees] -> Nγ smooth, rough."""

WEIGHTLESS = {
    0: (Ground(3.0, 1.5, 0.01), 0.05),
    10: (Ground(3.0, 1.5, 0.01), 0.06),
    20: (Ground(4.0, 2.0, 0.01), 0.1),
    30: (Ground(6.0, 3.0, 0.01), 0.2),
    35: (Ground(8.0, 3.5, 0.01), 0.3),
    40: (Ground(12.0, 5.0, 0.01), 0.5),
}
"""Angle of friction -> ground that holds the mechanism, and the settlement [B] at which the load is constant."""

HEAVY = {
    10: (Ground(1.6, 0.8, 0.005), 0.01),
    20: (Ground(2.0, 1.0, 0.0075), 0.03),
    30: (Ground(3.0, 1.5, 0.0075), 0.06),
    35: (Ground(3.5, 1.8, 0.01), 0.1),
    40: (Ground(5.0, 2.5, 0.01), 0.2),
}
"""The same for ground with weight, whose mechanism is smaller."""


def surcharge_factor(angle: float) -> float:
    """Return Nq = exp(π tanφ) tan²(45° + φ/2) of an angle of friction [degrees]."""
    phi = np.radians(angle)
    return float(np.exp(np.pi * np.tan(phi)) * np.tan(0.25 * np.pi + 0.5 * phi) ** 2)


def cohesion_factor(angle: float) -> float:
    """Return Nc = (Nq − 1) cotφ of an angle of friction [degrees]."""
    return float((surcharge_factor(angle) - 1.0) / np.tan(np.radians(angle))) if angle else 2.0 + np.pi


def rows() -> Iterator[Row]:
    """Yield Nc, Nq and Nγ at 10 to 40°, smooth and rough, and Nc without friction."""
    yield from (weightless(0, rough, cohesion=1.0) for rough in (False, True))
    for angle in NGAMMA:
        yield from (weightless(angle, rough, cohesion=1.0) for rough in (False, True))
        yield from (weightless(angle, rough, surcharge=1.0) for rough in (False, True))
    for angle in NGAMMA:
        yield from (heavy(angle, rough) for rough in (False, True))


def weightless(angle: int, rough: bool, cohesion: float = 0.0, surcharge: float = 0.0) -> Row:
    """Return the row of Nc, for a cohesion of one, or of Nq, for a surcharge of one."""
    ground, settlement = WEIGHTLESS[angle]
    name, reference = ("Nc", cohesion_factor(angle)) if cohesion else ("Nq", surcharge_factor(angle))
    answer = solve(footing(soil(angle, cohesion=cohesion), settlement, rough, surcharge), ground.mesh("quad"))
    return _row(f"{name} {_KINDS[rough]}, φ = {angle}°", reference, answer, 0.02, above=surcharge)


def heavy(angle: int, rough: bool) -> Row:
    """Return the row of Nγ: neither cohesion nor surcharge."""
    ground, settlement = HEAVY[angle]
    answer = solve(footing(soil(angle, unit_weight=1.0), settlement, rough), ground.mesh("quad"))
    return _row(f"Nγ {_KINDS[rough]}, φ = {angle}°", NGAMMA[angle][rough], answer, 0.05, factor=2.0)


_KINDS = {False: "smooth", True: "rough"}


def soil(angle: float, cohesion: float = 0.0, unit_weight: float = 0.0) -> dict[str, float | str]:
    """Return an associated Mohr–Coulomb soil, E = 1000."""
    return {
        "model": "mohr_coulomb",
        "youngs_modulus": 1e3,
        "poisson_ratio": 0.3,
        "cohesion": cohesion,
        "friction_angle": angle,
        "dilation_angle": angle,
        "unit_weight": unit_weight,
    }


def _row(name: str, reference: float, answer: Answer, tolerance: float, factor: float = 1.0, above: float = 0.0) -> Row:
    load = answer.final("load")
    got = None if load is None else factor * (above + load)
    return Row(name, reference, got, tolerance, answer.seconds, settled(answer, "quad8"))
