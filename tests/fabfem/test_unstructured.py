"""Linear elements on meshes that gmsh makes: a quarter of the nearly incompressible cylinder, u_r = 6e-5 m inside."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fabfem.fem.kinematics import KINEMATICS
from fabfem.fem.loads import Pressure
from fabfem.fem.mesh import Mesh
from fabfem.fem.mesh_files import read_mesh
from fabfem.fem.model import Model, Zone
from fabfem.fem.patches import patches
from fabfem.fem.solve import Increment, march
from fabfem.fem.space import build_space
from fabfem.fem.stages import Stage
from fabfem.fem.supports import Support
from umat import Elastic, initial_state

NEARLY = Elastic(2e5, 0.4999)
CORNERS = ((0.0, 0.0), (0.1, 0.0), (0.2, 0.0), (0.0, 0.2), (0.0, 0.1))
SIDES = ("on_x", "outer", "on_y", "inner")
HELD = {2: (), 3: (Support("front", "z"), Support("back", "z"))}

MESHES = [(2, 0.01, 0.544, 0.997), (2, 0.005, 0.724, 0.999), (3, 0.02, 0.181, 0.986), (3, 0.0125, 0.256, 0.993)]
"""Dimension, element size [m], share of the exact movement with a volume strain at each point, and with the mean."""


@pytest.mark.parametrize(("dim", "size", "locked", "free"), MESHES)
def test_linear_simplices_do_not_lock(tmp_path: Path, dim: int, size: float, locked: float, free: float) -> None:
    gmsh = pytest.importorskip("gmsh")
    mesh = quarter(gmsh, tmp_path / "quarter.msh", dim, size)
    counts = np.bincount(patches(mesh))
    assert counts.min() >= (2 if dim == 2 else 6)
    assert counts.mean() == pytest.approx(2.3 if dim == 2 else 8.3, abs=0.3)
    assert moved(mesh, mean=False) == pytest.approx(locked, rel=0.1)
    assert moved(mesh, mean=True) == pytest.approx(free, abs=0.004)


def quarter(gmsh: Any, path: Path, dim: int, size: float) -> Mesh:
    """A quarter ring, 0.05 m thick where it is solid."""
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    add = gmsh.model.geo
    centre, *ends = (add.addPoint(x, y, 0.0) for x, y in CORNERS)
    a, b, c, d = ends
    lines = [add.addLine(a, b), add.addCircleArc(b, centre, c), add.addLine(c, d), add.addCircleArc(d, centre, a)]
    face = add.addPlaneSurface([add.addCurveLoop(lines)])
    made = add.extrude([(2, face)], 0.0, 0.0, 0.05) if dim == 3 else []
    add.synchronize()
    sides = [tag for _, tag in made[2:]] if dim == 3 else lines
    named = dict(zip(SIDES, sides, strict=True)) | ({"front": face, "back": made[0][1]} if dim == 3 else {})
    for name, tag in named.items():
        gmsh.model.addPhysicalGroup(dim - 1, [tag], name=name)
    gmsh.model.addPhysicalGroup(dim, [made[1][1] if dim == 3 else face], name="metal")
    for option in ("Min", "Max"):
        gmsh.option.setNumber(f"Mesh.MeshSize{option}", size)
    gmsh.model.mesh.generate(dim)
    gmsh.write(str(path))
    gmsh.finalize()
    return read_mesh(path)


def moved(mesh: Mesh, mean: bool) -> float:
    """Mean radial movement of the inner wall under 60 MPa over the exact one."""
    kinematics = KINEMATICS["plane_strain" if mesh.dim == 2 else "solid"]
    space = build_space(mesh, replace(kinematics, mean_dilation=mean))
    zone = Zone(NEARLY, None, initial_state(NEARLY, None, np.zeros((space.npoints, 6))), slice(None))
    held = (Support("on_x", "y"), Support("on_y", "x"), *HELD[mesh.dim])
    stage = Stage("press", held, (Pressure("inner", 60.0),), first=1.0, largest=1.0)
    (step,) = march(Model(space, {"metal": zone}, (stage,)))
    assert isinstance(step, Increment)
    nodes = np.unique(mesh.boundary("inner"))
    places, u = mesh.points[nodes, :2], step.displacement.reshape(-1, mesh.dim)[nodes, :2]
    return float(((places * u).sum(axis=1) / np.linalg.norm(places, axis=1)).mean() / 6e-5)
