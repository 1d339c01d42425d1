"""Elastic extremes against exact answers: stiffness contrast, flat elements, incompressible soil and water, units."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from fabfem.extremes.sweep import Extreme, Found, sweep
from fabfem.fem.box import grid_mesh
from fabfem.fem.mesh import Mesh
from fabfem.verification import bearing_capacity, undrained_tube
from fabfem.verification.cylinder import cylinder
from fabfem.verification.ground import Ground, footing
from fabfem.verification.ring import pressing, ring, ring_mesh
from fabfem.verification.scene import Answer, Tables, held, solve, stage

DECADES = tuple(10.0**k for k in range(17))


def extremes() -> Iterator[Extreme]:
    """Yield the sweeps."""
    yield sweep("four layers, soft and stiff: settlement", "contrast of E", DECADES, layers, 1e-6, 1e6)
    yield sweep(
        "block half stiff, half soft under a rigid plate: settlement", "contrast of E", DECADES, columns, 1e-6, 1e6
    )
    yield sweep("Lamé's cylinder in flat elements: u(a)", "aspect of the elements", DECADES[:9], flat, 1e-6, 1e2)
    short = (0.2, *(10.0**-k for k in range(2, 13)))
    yield sweep("thick cylinder, quad8: u(a)", "½ − ν", short, lambda left: incompressible(0.5 - left), 0.005, 1e-4)
    stiff = (1e2, 1e4, 1e6, 1e8, 1e10, 1e12, 1e14, 1e16, np.inf)
    yield sweep("thick tube, undrained: u(a)", "K_w/nK", stiff, water, 1e-3, 1e4)
    scales = (1e-3, 1.0, 1e3, 1e6, 1e-6, 1e-12, 1e12)
    yield sweep("strip footing, φ = 20°: load", "stress unit / kPa", scales, units, 1e-10, 1.0)


def layers(contrast: float) -> Found:
    """Return the settlement of four layers under a pressure, every other one `contrast` times as soft."""
    answer = solve(two(contrast, pressure=[{"boundary": "top", "value": 1.0}]), stack())
    return Found(answer.final("settlement"), 2.0 * (1.0 + contrast) / _OEDOMETRIC, answer.stopped)


def stack() -> Mesh:
    """Return four layers one high, soft and stiff by turns from the bottom."""
    mesh = grid_mesh("quad", [np.linspace(0.0, 1.0, 5), np.linspace(0.0, 4.0, 17)])
    return _zoned(mesh, mesh.points[mesh.cells].mean(axis=1)[:, 1] % 2.0 < 1.0)


def columns(contrast: float) -> Found:
    """Return the settlement of a smooth plate on a soft and a stiff half, which do not strain sideways: ν = 0."""
    mesh = grid_mesh("quad", [np.linspace(0.0, 2.0, 9), np.linspace(0.0, 1.0, 5)])
    soft = mesh.points[mesh.cells].mean(axis=1)[:, 0] < 1.0
    plate = {"boundary": "top", "contact": "smooth", "force": {"y": -1.0}, "motion": {"x": 0.0, "rotation": 0.0}}
    answer = solve(two(contrast, ratio=0.0, rigid=[plate]), _zoned(mesh, soft))
    return Found(answer.final("settlement"), 1.0 / (1.0 + 1.0 / contrast), answer.stopped)


def flat(aspect: float) -> Found:
    """Return the movement of Lamé's cylinder in elements `aspect` times as wide as high, over that in square ones."""
    return Found(_slice(aspect).final("inner"), _slice(1.0).final("inner") or np.nan, _slice(aspect).stopped)


def incompressible(ratio: float) -> Found:
    """Return the movement of the inner wall of an elastic cylinder for a Poisson's ratio."""
    answer = cylinder(0.1, 0.2, 60.0, 2e5, ratio, "quad", 10)
    lame = 60.0 * 0.1**2 / (0.2**2 - 0.1**2)
    exact = (1.0 + ratio) * lame * ((1.0 - 2.0 * ratio) * 0.1 + 0.2**2 / 0.1) / 2e5
    return Found(answer.final("inner"), exact, answer.stopped)


def water(stiffness: float) -> Found:
    """Return the movement of the inner wall of a tube full of water."""
    answer = undrained_tube.tube(stiffness)
    return Found(answer.final("inner"), undrained_tube.displacement(stiffness, undrained_tube.INNER), answer.stopped)


def units(scale: float) -> Found:
    """Return the load of a footing written in units of `scale` kPa, over that in kPa."""
    answers = [_footing(factor) for factor in (scale, 1.0)]
    loads = [answer.final("load") for answer in answers]
    return Found(None if loads[0] is None else loads[0] * scale, loads[1] or np.nan, answers[0].stopped)


_OEDOMETRIC = (1.0 - 0.3) / ((1.0 + 0.3) * (1.0 - 0.6))


def two(contrast: float, ratio: float = 0.3, **load: list[Tables]) -> Tables:
    """Return the tables of a body whose zone "stiff" has E = 1 and whose zone "soft" has less."""
    material = {"model": "elastic", "poisson_ratio": ratio}
    return {
        "scene": {"kind": "boundary_value", "kinematics": "plane_strain"},
        "material": {
            "stiff": material | {"youngs_modulus": 1.0, "zones": ["stiff"]},
            "soft": material | {"youngs_modulus": 1.0 / contrast, "zones": ["soft"]},
        },
        "support": held(left="x", right="x", bottom="y"),
        "stage": [stage("load", 1.0, 1.0, **load)],
        "probe": [{"name": "settlement", "boundary": "top", "component": "y", "scale": -1.0}],
    }


def _zoned(mesh: Mesh, soft: np.ndarray) -> Mesh:
    return replace(mesh, zones={"soft": np.flatnonzero(soft), "stiff": np.flatnonzero(~soft)})


def _slice(aspect: float) -> Answer:
    """A ring 16 elements wide and one high."""
    mesh = ring_mesh("quad", np.linspace(1.0, 2.0, 17), aspect)
    return solve(ring({"model": "elastic", "youngs_modulus": 1.0}, [pressing("inner", 1.0)]), mesh)


def _footing(scale: float) -> Answer:
    """A smooth footing on ground with weight, cohesion and friction."""
    soil = bearing_capacity.soil(20, cohesion=1.0 / scale, unit_weight=1.0 / scale)
    soil["youngs_modulus"] = 1e3 / scale
    return solve(footing(soil, 0.05, rough=False), Ground(2.0, 1.0, 0.1, 1.4).mesh("quad"))
