"""The exported routine in another finite-element code gives the curves of our own runs.

Kratos Multiphysics loads compiled UMATs by its `SmallStrainUMAT3DLaw`. The tests need an
interpreter with KratosGeoMechanicsApplication and KratosLinearSolversApplication: this one, or the one that the
environment variable FABFEM_KRATOS_PYTHON names. `python tests/clients/test_kratos.py` prints the comparison.
"""

import csv
import importlib.util
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

import umat
from fabfem.fem.box import box_mesh
from fabfem.fem.facets import outer_facets
from fabfem.fem.kinematics import KINEMATICS
from fabfem.fem.loads import Load, Pressure
from fabfem.fem.mesh import Mesh
from fabfem.fem.model import Controls, Model, Zone
from fabfem.fem.solve import Increment, march, reaction
from fabfem.fem.space import build_space
from fabfem.fem.stages import Stage
from fabfem.fem.supports import Support
from umat.directions import directions
from umat.export import Layout, export_umat
from umat.mandel import from_tensor
from umat.sands import toyoura

TOLERANCE = 1e-10
DIRECTIONS = "bazant_oh_21"
VOID_RATIO, NORM, PRESSURE = 0.8, 0.2, 100.0
INSTALLED = importlib.util.find_spec("KratosMultiphysics") is not None
KRATOS = os.environ.get("FABFEM_KRATOS_PYTHON", sys.executable if INSTALLED else "")


class Trial(NamedTuple):
    """A scene and the driving of a boundary."""

    mesh: Mesh
    kinematics: str
    held: tuple[Support, ...]
    loads: tuple[Load, ...]
    driven: str
    settlement: float
    increments: int
    forces: list[tuple[int, list[float]]]
    """Forces on nodes that are the loads."""


def triaxial() -> Trial:
    """One element under constant lateral stress, shortened by 10 %."""
    mesh = box_mesh("hexahedron", (1, 1, 1), (0, 0, 0), (1, 1, 1))
    held = (Support("left", "x"), Support("front", "y"), Support("bottom", "z"))
    loads = tuple(Pressure(side, PRESSURE, start=1.0, end=1.0) for side in ("right", "back"))
    sides = mesh.points[:, :2] * [-PRESSURE / 4, -PRESSURE / 4]
    forces = [(node, [*side, 0.0]) for node, side in enumerate(sides)]
    return Trial(mesh, "solid", held, loads, "top", 0.1, 40, forces)


def footing() -> Trial:
    """Half of a rough rigid strip, 2 m wide, on ground under a surcharge, pressed in by 20 mm."""
    mesh = box_mesh("quad", (8, 4), (0, -2), (4, 0))
    top = mesh.points[:, 1] == 0.0
    strip = outer_facets(mesh.cells, mesh.cell_type, np.flatnonzero(top & (mesh.points[:, 0] < 1.0 + 1e-9)))
    mesh = replace(mesh, boundaries=mesh.boundaries | {"strip": strip})
    held = (Support("left", "x"), Support("right", "x"), Support("bottom", "y"), Support("bottom", "x"),
            Support("strip", "x"))  # fmt: skip
    loads = (Pressure("top", PRESSURE, start=1.0, end=1.0),)
    shares = np.where(np.isin(mesh.points[:, 0], (0.0, 4.0)), 0.25, 0.5)
    forces = [(int(node), [0.0, -PRESSURE * shares[node]]) for node in np.flatnonzero(top)]
    return Trial(mesh, "plane_strain", held, loads, "strip", 0.02, 40, forces)


TRIALS: dict[str, Callable[[], Trial]] = {"triaxial": triaxial, "footing": footing}


def our_curve(trial: Trial) -> np.ndarray:
    """Return displacement and force of the driven boundary."""
    space = build_space(trial.mesh, KINEMATICS[trial.kinematics])
    axis = "xyz"[trial.mesh.dim - 1]
    up = np.eye(3)[trial.mesh.dim - 1]
    fabric = NORM / 6.0**0.5 * from_tensor(3.0 * np.outer(up, up) - np.eye(3))
    stress = np.tile([PRESSURE] * 3 + [0.0] * 3, (space.npoints, 1))
    sand, rule = toyoura(), directions(DIRECTIONS)
    state = umat.initial_state(sand, rule, stress, void_ratio=VOID_RATIO, fabric=fabric)
    step = 1.0 / trial.increments
    driven = Support(trial.driven, axis, -trial.settlement)
    stage = Stage("drive", (*trial.held, driven), trial.loads, first=step, largest=step)
    model = Model(space, {"all": Zone(sand, rule, state, slice(None))}, (stage,), Controls(tolerance=TOLERANCE))
    steps = list(march(model))
    assert all(isinstance(step, Increment) and not step.cutbacks for step in steps), steps[-1]
    forces = [reaction(space, step, trial.driven, axis) for step in steps]
    return np.column_stack([[-trial.settlement * step.fraction for step in steps], forces])


def scene_of(trial: Trial, library: Path, layout: Layout) -> dict[str, Any]:
    """Return the scene for `kratos_run.py`, a plane one as a slice of thickness 1 that cannot move along z.

    Kratos' plane elements that take a law of four components have pore pressures; the solids have not.
    """
    mesh, flat, count = trial.mesh, trial.mesh.dim == 2, len(trial.mesh.points)
    layers = range(2 if flat else 1)
    nodes = [[*point, *[float(layer)] * flat] for layer in layers for point in mesh.points.tolist()]
    elements = [[node + count * layer for layer in layers for node in cell] for cell in mesh.cells.tolist()]

    def there(boundary: str) -> list[int]:
        plane = sorted({int(node) for node in mesh.boundary(boundary).ravel()})
        return [node + count * layer for layer in layers for node in plane]

    fixed = [(node, support.component) for support in trial.held for node in there(support.boundary)]
    shares = [(node + count * layer, force) for layer in layers for node, force in trial.forces]
    return {
        "nodes": nodes,
        "elements": elements,
        "library": str(library),
        "properties": [VOID_RATIO, NORM, 0.0, 0.0, float(mesh.dim)],
        "state_variables": layout.state_variables,
        "fixed": fixed + [(node, "z") for node in range(len(nodes)) if flat],
        "forces": [(node, (np.array([*force, 0.0][:3]) / len(layers)).tolist()) for node, force in shares],
        "driven": there(trial.driven),
        "axis": "xyz"[mesh.dim - 1],
        "stress": [-PRESSURE] * 3 + [0.0] * 3,
        "tolerance": TOLERANCE,
        "displacements": (-trial.settlement * np.arange(trial.increments + 1) / trial.increments).tolist(),
    }


def kratos_curve(trial: Trial, folder: Path) -> np.ndarray:
    """Return the same from Kratos with the exported library, and zero displacement before."""
    library = folder / "libch.so"
    layout = export_umat(toyoura(), directions(DIRECTIONS), library)
    (folder / "scene.json").write_text(json.dumps(scene_of(trial, library, layout)), encoding="utf-8")
    script = Path(__file__).with_name("kratos_run.py")
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    subprocess.run(
        [KRATOS, str(script), str(folder / "scene.json"), str(folder / "curve.csv")],
        check=True, capture_output=True, env=environment,
    )  # fmt: skip
    with (folder / "curve.csv").open(encoding="utf-8") as file:
        return np.array([[float(number) for number in row] for row in list(csv.reader(file))[1:]])


@pytest.mark.skipif(not KRATOS, reason="Kratos is not installed and FABFEM_KRATOS_PYTHON names no interpreter with it")
@pytest.mark.parametrize("name", TRIALS)
def test_another_code_gives_the_same_curve(name: str, tmp_path: Path) -> None:
    trial = TRIALS[name]()
    ours, theirs = our_curve(trial), kratos_curve(trial, tmp_path)
    np.testing.assert_allclose(theirs[1:, 0], ours[:, 0], rtol=1e-12)
    np.testing.assert_allclose(theirs[1:, 1], ours[:, 1], rtol=1e-6)


if __name__ == "__main__":
    for name, make in TRIALS.items():
        trial = make()
        with tempfile.TemporaryDirectory() as folder:
            ours, theirs = our_curve(trial), kratos_curve(trial, Path(folder))
        worst = np.abs(theirs[1:, 1] / ours[:, 1] - 1.0).max()
        print(f"{name}: {len(ours)} increments, force {ours[-1, 1]:.6f} and {theirs[-1, 1]:.6f}, apart by {worst:.1e}")
