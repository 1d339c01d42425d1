"""Factors of safety of slopes against upper bounds of one rotational mechanism each, associated flow.

A converged answer lies at the bound or a little below it; displacement elements are too strong and lie above. The
vertical cut without friction is known between 3.776 and 3.786 γH/c [Pastor et al. 2000, Lyamin & Sloan 2002]; with
φ = 20° its bound is 5.5049.
"""

from collections.abc import Iterator

from fabfem.verification.row import Row
from fabfem.verification.scene import Tables, held, solve
from fabfem.verification.slope import Slope, bracket, factor, searched

HEIGHT, WEIGHT = 10.0, 20.0
GENTLE = Slope(HEIGHT, 20.0, 12.0, fine=0.5)
STEEP = Slope(HEIGHT, 10.0, 12.0, toe=8.0, depth=5.0, fine=0.55)
GROUND = Slope(HEIGHT, 20.0, 12.0, toe=10.0, depth=5.0, fine=0.6)
DEEP = Slope(HEIGHT, 20.0, 20.0, toe=20.0, depth=10.0, fine=0.8, growth=1.03)
CUT = Slope(HEIGHT, 0.0, 15.0, toe=5.0, depth=3.0, fine=0.25, growth=1.1)

SLOPES: dict[str, tuple[Slope, float, float, float, float]] = {
    "Griffiths & Lane 1, 2:1, φ = 20°, c/γH = 0.05": (GENTLE, 10.0, 20.0, 1.3682, 1.0),
    "Dawson, 45°, φ = 20°, c = 12.38 kPa": (STEEP, 12.38, 20.0, 1.0002, 0.7),
    "ACADS 1(a), 2:1, φ = 19.6°, c = 3 kPa": (GROUND, 3.0, 19.6, 0.9845, 0.7),
    "vertical cut, γH/c = 3.2, φ = 0": (CUT, HEIGHT * WEIGHT / 3.2, 0.0, 3.781 / 3.2, 0.8),
    "vertical cut, γH/c = 5.5049, φ = 20°": (CUT, HEIGHT * WEIGHT / 5.5049, 20.0, 1.0, 0.7),
}
"""What -> shape, c [kPa], φ [degrees], reference, factor under which the weight is turned on."""

CLAY = {0.6: 0.994, 1.0: 1.4717, 1.5: 2.0228}
"""Strength of the ground over that of the slope, cu/γH = 0.25 -> factor of safety [Griffiths & Lane 1999, Ex. 4]."""


def rows() -> Iterator[Row]:
    """Yield the factors of safety."""
    for name in SLOPES:
        yield known(name)
    for ratio in CLAY:
        yield layered(ratio)


def known(name: str) -> Row:
    """Return the row of a slope of the table."""
    shape, cohesion, angle, reference, stand = SLOPES[name]
    return _row(name, shape, {"soil": soil(cohesion, angle)}, reference, stand)


def layered(ratio: float) -> Row:
    """Return the row of a clay slope on ground `ratio` times as strong, which is as deep as the slope is high."""
    strength = 0.25 * HEIGHT * WEIGHT
    materials = {
        "slope": soil(strength, 0.0) | {"zones": ["slope"]},
        "ground": soil(ratio * strength, 0.0) | {"zones": ["ground"]},
    }
    return _row(f"Griffiths & Lane 4, φ = 0, cu2/cu1 = {ratio:g}", DEEP, materials, CLAY[ratio], 0.7)


def soil(cohesion: float, angle: float) -> Tables:
    """Return an associated Mohr–Coulomb soil of weight 20 kN/m³; ν = 0.45 where it has no friction."""
    return {
        "model": "mohr_coulomb",
        "youngs_modulus": 1e5,
        "poisson_ratio": 0.3 if angle else 0.45,
        "cohesion": cohesion,
        "friction_angle": angle,
        "dilation_angle": angle,
        "unit_weight": WEIGHT,
    }


def _row(name: str, shape: Slope, materials: dict[str, Tables], reference: float, stand: float) -> Row:
    tables = searched(materials, stand)
    if shape.toe:
        tables["support"] = held(left="x", right="x", bottom="xy")
    answer = solve(tables, shape.mesh())
    return Row(name, reference, factor(answer), 0.02, answer.seconds, bracket(answer))
