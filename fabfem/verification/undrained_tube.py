"""A thick elastic tube under pressure inside while no water flows: Lamé's with the undrained bulk modulus.

The mean total stress of the tube is the same everywhere, and so is the pore pressure: what a pair of elements that
locks or oscillates does not give. K_u = K + K_w / n, and u = A ((1 − 2ν_u) r + b²/r) / 2G with A = p a²/(b² − a²).
"""

from collections.abc import Iterator

import numpy as np

from fabfem.fem.porous_space import PorousSpace
from fabfem.verification.ring import ring, ring_mesh
from fabfem.verification.row import Row
from fabfem.verification.scene import Answer, Tables, solve

INNER, OUTER, PRESSURE, MODULUS, RATIO, POROSITY, ACROSS = 0.1, 0.2, 60.0, 1e4, 0.2, 0.4, 8
SHEAR = MODULUS / (2.0 * (1.0 + RATIO))
BULK = MODULUS / (3.0 * (1.0 - 2.0 * RATIO))
LAME = PRESSURE * INNER**2 / (OUTER**2 - INNER**2)
"""A"""


def rows() -> Iterator[Row]:
    """Yield displacements and pore pressures for water 100 and 10⁴ times as stiff as the skeleton or rigid."""
    for stiffness in (1e2, 1e4, np.inf):
        answer = tube(stiffness)
        name, note = f"K_w/nK = {stiffness:g}", answer.stopped or f"{ACROSS} quad8 across the wall"
        for wall, radius in (("inner", INNER), ("outer", OUTER)):
            seconds = answer.seconds if wall == "inner" else 0.0
            reference = displacement(stiffness, radius)
            yield Row(f"u({wall}), {name}", reference, answer.final(wall), 0.005, seconds, note)
        for kind, end in (("least", 0), ("largest", -1)):
            got = None if answer.stopped else float(np.sort(pressures(answer))[end])
            yield Row(f"{kind} pore pressure, {name}", suction(stiffness), got, 0.005)


def tube(stiffness: float) -> Answer:
    """Return the answer for K_w/nK = `stiffness`."""
    material: Tables = {"model": "elastic", "youngs_modulus": MODULUS, "poisson_ratio": RATIO, "porosity": POROSITY}
    water: Tables = {"unit_weight": 10.0, "excess": True}
    if np.isfinite(stiffness):
        water["bulk_modulus"] = stiffness * BULK * POROSITY
    once = {"initial": 1.0, "maximum": 1.0}
    load: Tables = {"name": "load", "kind": "load", "drainage": "undrained", "increments": once}
    load["pressure"] = [{"boundary": "inner", "value": PRESSURE}]
    return solve(ring(material, [load], water=water), ring_mesh("quad", np.linspace(INNER, OUTER, ACROSS + 1)))


def displacement(stiffness: float, radius: float) -> float:
    """Return the exact displacement at a radius."""
    bulk = BULK * (1.0 + stiffness)
    ratio = 0.5 if np.isinf(bulk) else (3.0 * bulk - 2.0 * SHEAR) / (6.0 * bulk + 2.0 * SHEAR)
    return LAME / (2.0 * SHEAR) * ((1.0 - 2.0 * ratio) * radius + OUTER**2 / radius)


def suction(stiffness: float) -> float:
    """Return the exact pore pressure, compression positive: −A / ((1 + n K/K_w) + nG/3K_w)."""
    return -LAME / (1.0 + (1.0 + SHEAR / (3.0 * BULK)) / stiffness)


def pressures(answer: Answer) -> np.ndarray:
    """Return the pore pressures at the nodes of the last increment."""
    assert answer.last is not None
    space = answer.problem.model.space
    assert isinstance(space, PorousSpace)
    return space.nodal_pressure(answer.last.displacement)
