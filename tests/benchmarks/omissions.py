"""What a scene saves by leaving out: ``python tests/benchmarks/omissions.py`` writes the table of docs/study.md.

Each pair is one problem twice, without and with what its symmetry or its law makes superfluous. The answer is a force
at the end; where both give the same one their difference is rounding, or falls with the mesh of the dearer one. A run
has a process of its own, goes once in small to load the kernels, then five times: processor time is the least, memory
the most that the process has held beyond what it held before.
"""

import gc
import json
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from page import write_table

import umat
from fabfem.fem.box import grid_mesh
from fabfem.fem.facets import outer_facets
from fabfem.fem.increment import Increment
from fabfem.fem.kinematics import KINEMATICS
from fabfem.fem.loads import Pressure
from fabfem.fem.mesh import Mesh, quadratic
from fabfem.fem.model import Controls, Model, Zone
from fabfem.fem.solve import march, reaction
from fabfem.fem.space import build_space
from fabfem.fem.stages import Stage
from fabfem.fem.supports import RigidBody, Support
from fabfem.study.worker import forget_peak_memory
from fabfem.substance import rule_for
from umat.fabric import Constant, ZhaoKruyt
from umat.mandel import IDENTITY
from umat.sands import SANDS

REPEATS = 5
RULE = "lebedev_23"
OVERBURDEN = 20.0
"""Stress in the ground at the start, under a surcharge of the same size [kPa]."""
METAL = umat.VonMises(1e4, 0.3, 30.0, 500.0)


class Run(NamedTuple):
    """What a run gave."""

    answer: float
    seconds: float
    """Processor time [s]."""
    memory: float
    """Memory beyond that of the program [MiB]."""
    said: str
    """Unknowns, points, directions."""


Scene = Callable[[float], tuple[Model, Callable[[Increment], float]]]
"""A problem with elements so many times as large as usual, and its answer."""


def footing(law: object, flat: bool = True, solid: bool = False) -> Scene:
    """Return half a rough footing, B = 1, on a bed of Toyoura sand, all of the answer its load per length."""

    def scene(size: float) -> tuple[Model, Callable[[Increment], float]]:
        mesh = bed(size, solid)
        space = build_space(quadratic(mesh), KINEMATICS["solid" if solid else "plane_strain"])
        up = space.components[-1]
        rule, _ = rule_for(RULE, flat and not solid)
        sand = SANDS["toyoura"](newtons=1e3, metres=1.0)._replace(law=law)
        axis = np.full(6, -1.0) * [1, 1, 1, 0, 0, 0]
        axis[space.mesh.dim - 1] = 2.0
        start = np.tile(OVERBURDEN * IDENTITY, (space.npoints, 1))
        state = umat.initial_state(sand, rule, start, void_ratio=0.75, fabric=0.208 / 6.0**0.5 * axis)
        held = [Support(*at) for at in (("left", "x"), ("right", "x"), ("bottom", "x"), ("bottom", up))]
        held += [Support(*at) for at in (("front", "y"), ("back", "y")) if solid]
        pushed = (Support("footing", "x"), Support("footing", up, -0.004))
        top = tuple(Pressure(name, OVERBURDEN, 1.0, 1.0) for name in ("footing", "surface"))
        stage = Stage("settlement", (*held, *pushed), top, first=0.1, largest=0.1)
        model = Model(space, {"all": Zone(sand, rule, state, slice(None))}, (stage,), Controls(tolerance=1e-10))
        return model, lambda step: -2.0 * reaction(space, step, "footing", up) / (THICK if solid else 1.0)

    return scene


THICK = 0.1
"""Thickness of the slab [B]."""


def bed(size: float, solid: bool) -> Mesh:
    """Return a linear mesh of the ground, 2 by 1, with the boundaries footing and surface on its top."""
    x, up = np.linspace(0.0, 2.0, round(24 / size) + 1), np.linspace(-1.0, 0.0, round(12 / size) + 1)
    mesh = grid_mesh("hexahedron", [x, np.array([0.0, THICK]), up]) if solid else grid_mesh("quad", [x, up])
    left, on_top = mesh.points[:, 0] - 0.5, mesh.points[:, -1] == 0.0
    parts = {"footing": on_top & (left <= 1e-9), "surface": on_top & (left >= -1e-9)}
    named = {name: outer_facets(mesh.cells, mesh.cell_type, np.flatnonzero(at)) for name, at in parts.items()}
    return replace(mesh, boundaries={name: b for name, b in mesh.boundaries.items() if name != "top"} | named)


def ring(sectors: int = 0) -> Scene:
    """Return a metal ring between rough platens, twisted until it yields throughout; the answer is the torque.

    Without sectors it is a section with torsion, otherwise all of the ring in so many curved solids around.
    """

    def scene(size: float) -> tuple[Model, Callable[[Increment], float]]:
        count = round(6 / size)
        r, z = np.linspace(0.03, 0.05, count + 1), np.linspace(0.0, 0.02, count + 1)
        mesh = around(r, z, sectors) if sectors else quadratic(grid_mesh("quad", [r, z]))
        space = build_space(mesh, KINEMATICS["solid" if sectors else "axisymmetric_torsion"])
        state = umat.initial_state(METAL, None, np.zeros((space.npoints, 6)))
        turn = {"rotation_z" if sectors else "rotation": 0.004}
        others = [name for name in ("x", "y", "z", "rotation_x", "rotation_y") if sectors or name == "z"]
        top = (0.0, 0.0, 0.02) if sectors else (0.0, 0.02)
        platen = RigidBody("top", space.components, top, turn | dict.fromkeys(others, 0.0))
        below = tuple(Support("bottom", component) for component in space.components)
        stage = Stage("twist", below, (), first=0.1, largest=0.1, bodies=(platen,))
        zones = {"all": Zone(METAL, None, state, slice(None))}
        return Model(space, zones, (stage,), Controls(tolerance=1e-10)), lambda step: torque(space.mesh, step)

    return scene


def around(r: np.ndarray, z: np.ndarray, sectors: int) -> Mesh:
    """Return a ring of 20-node solids whose curved edges lie on circles."""
    mesh = quadratic(grid_mesh("hexahedron", [r, np.linspace(0.0, 2.0 * np.pi, sectors + 1), z]), "hexahedron20")
    radius, angle, height = mesh.points.T
    points = np.stack([radius * np.cos(angle), radius * np.sin(angle), height], axis=1)
    _, kept, number = np.unique(np.round(points, 9), axis=0, return_index=True, return_inverse=True)
    number = number.ravel()
    sides = {name: number[facets] for name, facets in mesh.boundaries.items() if name in ("bottom", "top")}
    return replace(mesh, points=points[kept], cells=number[mesh.cells], boundaries=sides)


def torque(mesh: Mesh, step: Increment) -> float:
    """Return the torque on the top about the axis."""
    nodes = mesh.nodes_on("top")
    force = (step.internal_force - step.external_force).reshape(len(mesh.points), -1)[nodes]
    if mesh.dim == 2:
        return float(mesh.points[nodes, 0] @ force[:, 2])
    x, y, _ = mesh.points[nodes].T
    return float(x @ force[:, 1] - y @ force[:, 0])


FROZEN = Constant()
SCENES: dict[str, Scene] = {
    "quarter": footing(FROZEN),
    "half": footing(FROZEN, flat=False),
    "at rest": footing(ZhaoKruyt(h=0.0)),
    "evolving": footing(ZhaoKruyt()),
    "slab": footing(FROZEN, solid=True),
    "section": ring(),
    **{f"ring {count}": ring(count) for count in (8, 16, 32)},
}
PAIRS = [
    ("a quarter of the sphere of directions", "quarter", "half of it", "half"),
    ("frozen fabric", "quarter", "a law of evolution whose rate is zero", "at rest"),
    ("frozen fabric", "quarter", "evolving fabric (another model)", "evolving"),
    ("plane strain, a quarter of the sphere", "quarter", "slab of one element, half of the sphere", "slab"),
    *(
        ("section with torsion", "section", f"all of the ring, {count} solids around", f"ring {count}")
        for count in (8, 16, 32)
    ),
]
HEADINGS = (
    *("without", "with", "answer differs by"),
    *("processor time [s]", "ratio", "memory [MiB]", "ratio of memory"),
)


def measure(name: str) -> Run:
    """Return what a run of a scene gives and takes."""
    _last(SCENES[name](3.0)[0])
    gc.collect()
    forget_peak_memory()
    before, times = _status("VmRSS"), []
    for _ in range(REPEATS):
        begun = time.process_time()
        model, answer = SCENES[name](1.0)
        step = _last(model)
        times.append(time.process_time() - begun)
    rule = model.zones["all"].directions
    said = f"{model.space.ndof:,} unknowns, {model.space.npoints:,} points"
    said += f", {len(rule)} directions" if rule else ""
    return Run(answer(step), min(times), _status("VmHWM") - before, said)


def _last(model: Model) -> Increment:
    *_, step = march(model)
    assert isinstance(step, Increment), step
    return step


def _status(key: str) -> float:
    """Return an entry of the process's status [MiB]."""
    lines = Path("/proc/self/status").read_text(encoding="ascii").splitlines()
    return next(float(line.split()[1]) / 1024.0 for line in lines if line.startswith(key + ":"))


def _row(less: str, few: Run, more: str, many: Run) -> tuple[str, ...]:
    difference = abs(many.answer / few.answer - 1.0)
    return (
        *(f"{less} ({few.said})", f"{more} ({many.said})"),
        f"{difference:.1e}" if difference else "0",
        *(f"{few.seconds:.2g}, {many.seconds:.2g}", f"{many.seconds / few.seconds:.2g}"),
        *(f"{few.memory:.0f}, {many.memory:.0f}", f"{many.memory / few.memory:.2g}"),
    )


def main() -> None:
    """Run all scenes one after the other, and replace the table in the page."""
    found = {}
    for name in SCENES:
        done = subprocess.run([sys.executable, __file__, name], capture_output=True, text=True, check=True)
        found[name] = Run(**json.loads(done.stdout.splitlines()[-1]))
        print(name, found[name], flush=True)
    lines = ["| " + " | ".join(HEADINGS) + " |", "|" + "---|" * len(HEADINGS)]
    for less, one, more, other in PAIRS:
        lines.append("| " + " | ".join(_row(less, found[one], more, found[other])) + " |")
    write_table("study.md", "omissions", lines)


if __name__ == "__main__":
    if len(sys.argv) > 1:
        print(json.dumps(measure(sys.argv[1])._asdict()))
    else:
        main()
