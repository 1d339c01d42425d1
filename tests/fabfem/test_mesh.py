"""Meshes from files: names, upgrade to quadratic, and what is refused."""

from dataclasses import replace
from pathlib import Path

import meshio
import numpy as np
import pytest

from fabfem.fem.box import box_mesh
from fabfem.fem.elements import ELEMENTS
from fabfem.fem.facets import MeshError
from fabfem.fem.mesh import checked, quadratic
from fabfem.fem.mesh_files import from_meshio, read_mesh

SHIPPED = Path(__file__).parents[2] / "meshes"
POINTS = np.array([[0, 0], [1, 0], [2, 0], [0, 1], [1, 1], [2, 1]], float)
QUADS = np.array([[0, 1, 4, 3], [1, 2, 5, 4]])

ABAQUS = """*NODE
1, 0, 0
2, 1, 0
3, 2, 0
4, 0, 1
5, 1, 1
6, 2, 1
9, 7, 7
*ELEMENT, TYPE=CPE4, ELSET=clay
1, 1, 2, 5, 4
*ELEMENT, TYPE=CPE4, ELSET=sand
2, 2, 3, 6, 5
*NSET, NSET=base
1, 2, 3
*NSET, NSET=middle
2, 5
"""


def two_quads(**changes) -> meshio.Mesh:
    record = {"points": POINTS, "cells": [("line", [[0, 1], [1, 2]]), ("quad", QUADS)]}
    record["cell_sets"] = {"base": [[0, 1], []], "clay": [[], [0]], "sand": [[], [1]], "all": [[0, 1], [0, 1]]}
    return meshio.Mesh(**(record | changes))


def test_shipped_footing_mesh() -> None:
    mesh = read_mesh(SHIPPED / "strip_half.msh")
    assert mesh.cell_type == "triangle6"
    assert set(mesh.boundaries) == {"footing", "surface", "symmetry", "side", "bottom"}
    assert np.array_equal(mesh.zone("soil"), np.arange(len(mesh.cells)))
    assert 3000 <= 3 * len(mesh.cells) <= 6000
    footing = mesh.points[mesh.boundary("footing")]
    assert np.abs(footing[..., 1]).max() == 0.0
    assert footing[..., 0].min() == 0.0
    assert footing[..., 0].max() == pytest.approx(0.45, abs=1e-12)


def test_abaqus_sets_become_zones_and_boundaries(tmp_path: Path) -> None:
    (tmp_path / "two.inp").write_text(ABAQUS)
    mesh = read_mesh(tmp_path / "two.inp")
    assert len(mesh.points) == 6
    assert mesh.zone("clay").tolist() == [0]
    assert mesh.zone("sand").tolist() == [1]
    assert mesh.boundary("base").tolist() == [[0, 1], [1, 2]]
    assert "middle" not in mesh.boundaries


@pytest.mark.parametrize("suffix", [".msh", ".vtu", ".inp"])
def test_formats_without_names_have_one_zone(tmp_path: Path, suffix: str) -> None:
    meshio.write(tmp_path / f"two{suffix}", meshio.Mesh(np.pad(POINTS, ((0, 0), (0, 1))), [("quad", QUADS)]))
    assert len(read_mesh(tmp_path / f"two{suffix}").zone("all")) == 2


def test_names_of_zones_and_boundaries() -> None:
    mesh = from_meshio(two_quads())
    assert mesh.zone("sand").tolist() == [1]
    assert mesh.zone("all").tolist() == [0, 1]
    assert mesh.boundary("base").tolist() == [[0, 1], [1, 2]]


@pytest.mark.parametrize("name", [name for name, row in ELEMENTS.items() if row.quadratic])
def test_quadratic_mesh_fills_the_same_box(name: str) -> None:
    dim = ELEMENTS[name].dim
    linear = box_mesh(name, (2, 1, 3)[:dim], (0.0,) * dim, (1.0, 2.0, 3.0)[:dim])
    mesh = quadratic(linear)
    nodes = mesh.points[mesh.cells]
    np.testing.assert_array_equal(nodes[:, : len(mesh.element.corners)], linear.points[linear.cells])
    middles = [nodes[:, list(parents)].mean(axis=1) for parents in mesh.element.midside]
    np.testing.assert_allclose(nodes[:, len(mesh.element.corners) :], np.stack(middles, axis=1), atol=1e-15)
    assert len(np.unique(mesh.points.round(9), axis=0)) == len(mesh.points)
    for side, facets in mesh.boundaries.items():
        assert len(facets) == len(linear.boundary(side))


def test_reading_upgrades_when_asked(tmp_path: Path) -> None:
    (tmp_path / "two.inp").write_text(ABAQUS)
    assert read_mesh(tmp_path / "two.inp", order=2).cell_type == "quad8"


@pytest.mark.parametrize(
    ("raw", "words"),
    [
        (two_quads(points=POINTS[[1, 0, 2, 4, 3, 5]]), "1 of 2 elements are inverted or have no volume: 0"),
        (two_quads(points=POINTS * [1, 0]), "2 of 2 elements"),
        (two_quads(points=np.column_stack([POINTS, POINTS[:, 0]])), "plane z = 0"),
        (meshio.Mesh(POINTS, [("quad", QUADS[:1]), ("triangle", [[1, 2, 5]])]), "mixes quad and triangle"),
        (meshio.Mesh(POINTS, [("line", [[0, 1]])]), "the mesh has elements line"),
        (meshio.Mesh(POINTS, [("polygon", [[0, 1, 2, 5, 4]])]), "usable are"),
        (two_quads(cells=[("line", [[0, 4], [1, 2]]), ("quad", QUADS)]), "belong to no element"),
    ],
)
def test_unusable_meshes_are_refused(raw: meshio.Mesh, words: str) -> None:
    with pytest.raises(MeshError, match=words):
        from_meshio(raw)


def test_missing_and_unreadable_files_are_refused(tmp_path: Path) -> None:
    with pytest.raises(MeshError, match="no mesh file"):
        read_mesh(tmp_path / "none.msh")
    for name in ("bad.msh", "bad.xyz"):
        (tmp_path / name).write_text("nothing")
        with pytest.raises(MeshError, match="cannot be read"):
            read_mesh(tmp_path / name)


def test_quadratic_elements_are_not_taken_for_linear_ones() -> None:
    with pytest.raises(MeshError, match="elements of order 2"):
        read_mesh(SHIPPED / "strip_half.msh", 1)


def test_unknown_names_list_those_that_exist() -> None:
    mesh = from_meshio(two_quads())
    with pytest.raises(MeshError, match="no boundary 'bass', did you mean 'base'; it has all, base"):
        mesh.boundary("bass")
    with pytest.raises(MeshError, match="no zone 'rock'; it has all, clay, sand"):
        mesh.zone("rock")


def test_check_finds_a_flattened_element() -> None:
    mesh = box_mesh("tetra10", (1, 1, 1), (0.0,) * 3, (1.0,) * 3)
    with pytest.raises(MeshError, match="6 of 6"):
        checked(replace(mesh, points=mesh.points * [1, 1, 1e-14]))
