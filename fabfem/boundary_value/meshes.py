"""The mesh that a case names: read from a file, cut from a box, or drawn by a script.

What a script draws depends on its text and on the parameters alone, so it is kept in the user's cache under their hash.
"""

import hashlib
import os
import subprocess
import sys
from pathlib import Path

import numpy as np

from fabfem.case import BoundaryValueCase
from fabfem.case.mesh import Box
from fabfem.fem.box import box_mesh
from fabfem.fem.elements import ELEMENTS
from fabfem.fem.mesh import Mesh, MeshError, read_mesh
from fabfem.fem.regions import Region, with_boundaries, with_zones
from fabfem.identity import hashed
from umat.cache import user_cache

TIME_LIMIT = 300.0
"""Longest time that a script may draw [s]."""


def mesh_of(case: BoundaryValueCase) -> Mesh:
    """Return the mesh that a case names.

    Raises
    ------
    MeshError
        If the file, or the script's, is no usable mesh, or a part that the case names is empty.
    """
    said = case.mesh
    sides = {name: (side.of, Region(side.lower, side.upper)) for name, side in said.boundary.items()}
    zones = {name: Region(zone.lower, zone.upper) for name, zone in said.zone.items()}
    return with_zones(with_boundaries(_drawn_or_read(case), sides), zones)


def _drawn_or_read(case: BoundaryValueCase) -> Mesh:
    """Return the mesh without the parts that the case names."""
    said = case.mesh
    if said.box is not None:
        return _box(said.box, said.order)
    if said.script is not None:
        return read_mesh(drawn(case.locate(said.script), said.parameters), said.order)
    assert said.file is not None
    return read_mesh(case.locate(said.file), said.order)


def mesh_file(case: BoundaryValueCase) -> Path | None:
    """Return the file of the mesh that a case names, drawn by now; None for a box."""
    said = case.mesh
    if said.script is not None:
        return drawn(case.locate(said.script), said.parameters)
    return None if said.file is None else case.locate(said.file)


def mesh_place(case: BoundaryValueCase) -> str:
    """Return the place in the case that the mesh comes from."""
    return next(f"mesh.{key}" for key in ("box", "script", "file") if getattr(case.mesh, key) is not None)


def hash_of(mesh: Mesh) -> str:
    """Return a hash of a mesh with its names."""
    parts = (mesh.zones, mesh.boundaries)
    named = [part for table in parts for name, ids in table.items() for part in (name.encode(), np.asarray(ids))]
    return hashed(mesh.points, mesh.cells, mesh.cell_type.encode(), *named)


def _box(box: Box, order: int) -> Mesh:
    cell_type = ELEMENTS[box.element].quadratic if order == 2 else box.element
    return box_mesh(cell_type, box.counts, box.lower, box.upper)


def drawn(script: Path, parameters: dict[str, int | float | str]) -> Path:
    """Return the file of the mesh that a script draws with some parameters; drawn before, it is not drawn again.

    Raises
    ------
    MeshError
        If there is no such script, or it fails.
    """
    if not script.is_file():
        raise MeshError(f"there is no script {script}.")
    words = [f"{name}={value}" for name, value in parameters.items()]
    key = hashlib.sha256("\0".join([script.read_text(encoding="utf-8"), *words]).encode()).hexdigest()[:16]
    folder = user_cache() / "fabfem-meshes"
    file = folder / f"{script.stem}-{key}.msh"
    if not file.is_file():
        folder.mkdir(parents=True, exist_ok=True)
        aside = folder / f"{os.getpid()}-{file.name}"
        _draw(script, aside, words)
        aside.replace(file)
    return file


def _draw(script: Path, file: Path, words: list[str]) -> None:
    """Let a script write a file."""
    try:
        done = subprocess.run(
            [sys.executable, str(script), str(file), *words],
            capture_output=True,
            text=True,
            timeout=TIME_LIMIT,
            check=False,
        )
    except subprocess.TimeoutExpired:
        raise MeshError(f"{script.name} drew no mesh within {TIME_LIMIT:g} s.") from None
    if done.returncode != 0 or not file.is_file():
        said = (done.stderr.strip() or "it wrote no file").splitlines()[-1]
        raise MeshError(f"{script.name} drew no mesh: {said.rstrip('.')}.")
