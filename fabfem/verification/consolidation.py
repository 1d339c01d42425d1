"""Consolidation: Terzaghi's layer, Mandel's slab and Cryer's sphere, each loaded at once and then left to drain.

Time T = c_v t / H², with c_v = k M / γ_w and M the modulus of one-dimensional compression; H is the drainage path, or
the radius. Terzaghi's degree and Mandel's pressure are series [1923; 1953], the peaks are those of Cryer [1963].
Pressures at stated times are interpolated between the time steps.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from fabfem.fem.box import box_mesh
from fabfem.fem.mesh import Mesh
from fabfem.verification.row import Row
from fabfem.verification.scene import Answer, Tables, held, solve

MODULUS, CONDUCTIVITY, WEIGHT, LOAD = 1e4, 1e-3, 10.0, 100.0
"""E [kPa], k [m per unit of time], γ_w [kN/m³] and the load [kPa]."""

DEGREE = {0.05: 0.252313, 0.1: 0.356823, 0.2: 0.504088, 0.5: 0.763950, 1.0: 0.931260}
"""T -> degree of consolidation (U) of a layer with one drained side."""
SLAB = {0.01: 1.04376, 0.05: 1.09888, 0.1: 1.09541, 0.2: 0.96811, 0.5: 0.59279}
"""T -> pressure at the middle of Mandel's slab over the first one, ν = 0.2."""
SPHERE = {0.0: (1.57543, 0.0627), 0.25: (1.30754, 0.0494)}
"""Poisson's ratio -> largest pressure at the centre over the applied one, and its T."""
SIZES = {"initial": 1e-4, "minimum": 1e-8, "maximum": 0.1}
"""Increments while water flows."""


def rows() -> Iterator[Row]:
    """Yield degrees of consolidation, pressures in the slab, and peaks in the sphere."""
    yield from layer()
    yield from slab()
    for ratio in SPHERE:
        yield from sphere(ratio)


def layer(cells: int = 20) -> Iterator[Row]:
    """Yield the degree of consolidation of a layer one deep."""
    mesh = box_mesh("quad", (1, cells), (0.0, 0.0), (2.0 / cells, 1.0))
    probe = {"name": "got", "boundary": "top", "component": "y", "scale": -oedometric(0.2) / LOAD}
    pressed = {"pressure": [{"boundary": "top", "value": LOAD}]}
    sides = held(left="x", right="x", bottom="y")
    answer = solve(draining("plane_strain", 0.2, sides, pressed, "top", 1.0, probe), mesh)
    yield from at_times(answer, "Terzaghi, U at T_v =", DEGREE, 0.2, f"{cells} quad8")


def slab(cells: int = 24) -> Iterator[Row]:
    """Yield the pressure in the middle of a slab between smooth rigid plates, drained on both sides."""
    mesh = box_mesh("quad", (cells, 1), (0.0, 0.0), (1.0, 0.1))
    plate = {"boundary": "top", "contact": "smooth", "force": {"y": -LOAD}, "motion": {"x": 0.0, "rotation": 0.0}}
    probe = {"name": "got", "kind": "pore_pressure", "boundary": "left", "scale": 2.0 / LOAD}
    answer = solve(
        draining("plane_strain", 0.2, held(left="x", bottom="y"), {"rigid": [plate]}, "right", 0.6, probe), mesh
    )
    yield from at_times(answer, "Mandel, p/p0 at T =", SLAB, 0.2, f"{cells} quad8")


def sphere(ratio: float, cells: int = 16) -> Iterator[Row]:
    """Yield the largest pressure at the centre of a sphere, and when it is there."""
    probe = {"name": "got", "kind": "pore_pressure", "point": [0.0, 0.0], "scale": 1.0 / LOAD}
    pressed = {"pressure": [{"boundary": ["top", "right"], "value": LOAD}]}
    tables = draining("axisymmetric", ratio, held(left="r", bottom="z"), pressed, ["top", "right"], 0.2, probe)
    answer = solve(tables, quarter_disc(cells))
    peak, when = SPHERE[ratio]
    note = answer.stopped or f"{cells**2} quad8"
    name = f"Cryer, ν = {ratio:g}, peak"
    yield Row(f"{name} p/q", peak, answer.measured(lambda done: _peak(done, ratio)[1]), 0.01, answer.seconds, note)
    yield Row(f"{name} T", when, answer.measured(lambda done: _peak(done, ratio)[0]), 0.1, 0.0, "the peak is flat")


def oedometric(ratio: float) -> float:
    """Return the modulus of one-dimensional compression (M) [kPa] for a Poisson's ratio."""
    return MODULUS * (1.0 - ratio) / ((1.0 + ratio) * (1.0 - 2.0 * ratio))


def draining(
    kinematics: str,
    ratio: float,
    support: list[Tables],
    load: Tables,
    drains: str | Sequence[str],
    until: float,
    probe: Tables,
    **more: Any,
) -> Tables:
    """Return the tables of a body that is loaded undrained and then drains, up to the time T = `until`."""
    material = {"model": "elastic", "youngs_modulus": MODULUS, "poisson_ratio": ratio, "conductivity": CONDUCTIVITY}
    both = {"kind": "load", **load}
    at_once = {"name": "load", "drainage": "undrained", "increments": {"initial": 1.0, "maximum": 1.0}, **both}
    flow = {"name": "flow", "drainage": "seepage", "drains": drains, "time_tolerance": 3e-4, "increments": SIZES}
    return {
        "scene": {"kind": "boundary_value", "kinematics": kinematics},
        "material": {"ground": material},
        "water": {"unit_weight": WEIGHT, "excess": True},
        "solver": {"tolerance": 1e-9},
        "support": support,
        "stage": [at_once, flow | {"duration": until / _rate(ratio)} | both],
        "probe": [probe],
        **more,
    }


def at_times(answer: Answer, name: str, expected: Mapping[float, float], ratio: float, note: str) -> Iterator[Row]:
    """Yield a row for each time T of a table."""
    times, values = _curve(answer, ratio)
    for number, (time, reference) in enumerate(expected.items()):
        got = None if answer.stopped else float(np.interp(time, times, values))
        shown = answer.stopped or (f"{note}, {len(times)} steps" if number == 0 else "")
        yield Row(f"{name} {time:g}", reference, got, 0.01, 0.0 if number else answer.seconds, shown)


def quarter_disc(cells: int) -> Mesh:
    """Return a square drawn onto a quarter of a disc of radius one, its skin the boundaries top and right."""
    mesh = box_mesh("quad", (cells, cells), (0.0, 0.0), (1.0, 1.0))
    x, y = mesh.points.T
    return replace(mesh, points=np.stack([x * np.sqrt(1.0 - 0.5 * y**2), y * np.sqrt(1.0 - 0.5 * x**2)], axis=1))


def _rate(ratio: float) -> float:
    """c_v / H² with H = 1."""
    return CONDUCTIVITY * oedometric(ratio) / WEIGHT


def _curve(answer: Answer, ratio: float) -> tuple[np.ndarray, np.ndarray]:
    """T and the probe at every time step since the load."""
    times = np.array([row["time"] for row in answer.history])
    return (times - times[0]) * _rate(ratio), np.array([row["got"] for row in answer.history])


def _peak(answer: Answer, ratio: float) -> tuple[float, float]:
    """The vertex (T, p/q) of the parabola through the three largest neighbours."""
    times, values = _curve(answer, ratio)
    top = int(np.clip(values.argmax(), 1, len(values) - 2))
    a, b, c = np.polyfit(times[top - 1 : top + 2], values[top - 1 : top + 2], 2)
    return -0.5 * b / a, c - 0.25 * b * b / a
