"""Hill's tube: a thick Tresca cylinder, b/a = 2, under pressure inside, in plane strain [Hill 1950, ch. V].

It yields first at p/k = 1 − a²/b²; with the plastic front at c, p/k = 2 ln(c/a) + 1 − c²/b²; it bursts at 2 ln(b/a).
Tresca's strength is Mohr–Coulomb's without friction, c = k.
"""

from collections.abc import Iterator

import numpy as np

from fabfem.verification.ring import at_wall, pressing, ring, ring_mesh, yielded_radius
from fabfem.verification.row import Row
from fabfem.verification.scene import Answer, Tables, solve, stage

ACROSS = 100
FRONTS = {1.25: 1.05566, 1.5: 1.24843, 1.75: 1.35361}
"""Place of the front c/a -> pressure p/k."""

TUBE: Tables = {
    "model": "mohr_coulomb",
    "youngs_modulus": 1e3,
    "poisson_ratio": 0.3,
    "cohesion": 1.0,
    "friction_angle": 0.0,
}


def rows() -> Iterator[Row]:
    """Yield first yield, the place of the front at three pressures, and the limit pressure."""
    mesh = ring_mesh("quad", np.linspace(1.0, 2.0, ACROSS + 1))
    half = solve(ring(TUBE, [pressing("inner", 0.5)]), mesh)
    yield Row("p/k at first yield", 0.75, half.measured(_first_yield), 0.01, half.seconds, half.stopped)
    for front, pressure in FRONTS.items():
        answer = solve(ring(TUBE, [pressing("inner", pressure, initial=0.25, maximum=0.25)]), mesh)
        name = f"front c/a at p/k = {pressure}"
        yield Row(name, front, answer.measured(yielded_radius), 0.01, answer.seconds, answer.stopped)
    area = 2.0 * np.pi * mesh.points[:, 1].max()
    reaction = {"name": "load", "boundary": "inner", "component": "r", "scale": 1.0 / area}
    widened = stage("widening", 0.01, 0.02, displacement=[{"boundary": "inner", "r": 0.02}])
    answer = solve(ring(TUBE, [widened], reaction=[reaction], solver={"tolerance": 1e-6}), mesh)
    yield Row("limit p/k", 2.0 * np.log(2.0), answer.final("load"), 0.01, answer.seconds, answer.stopped)


def _first_yield(half: Answer) -> float:
    """Return the pressure at which the shear stress at the wall reaches the strength, from that under half of one."""
    wall = at_wall(half, "inner")
    return float(0.5 * 2.0 / (wall[0] - wall[2]))
