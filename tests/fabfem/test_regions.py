"""Boundaries and zones that are named by where they lie."""

import re
from pathlib import Path

import numpy as np
import pytest

from fabfem.boundary_value.meshes import mesh_of
from fabfem.boundary_value.problem import build
from fabfem.case import BoundaryValueCase, CaseError, read_case
from fabfem.fem.box import box_mesh
from fabfem.fem.mesh import Mesh, MeshError
from fabfem.fem.regions import Region, with_boundaries, with_zones


@pytest.fixture(params=["quad8", "triangle6"])
def plane(request: pytest.FixtureRequest) -> Mesh:
    """A box of 4 by 2 m, cut at every half metre."""
    return box_mesh(request.param, (8, 4), (0.0, -2.0), (4.0, 0.0))


def length(mesh: Mesh, name: str) -> float:
    """Length of a boundary, by the ends of its facets."""
    ends = mesh.points[mesh.boundary(name)[:, :2]]
    return float(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).sum())


@pytest.mark.parametrize(("upper", "long"), [(1.5, 1.5), (1.6, 1.5), (1.99, 1.5), (4.0, 4.0)])
def test_a_part_of_a_boundary_has_the_facets_that_lie_in_it(plane: Mesh, upper: float, long: float) -> None:
    found = with_boundaries(plane, {"footing": ("top", Region((0.0, -0.1), (upper, 0.1)))})
    assert length(found, "footing") == pytest.approx(long)
    assert length(found, "top") == pytest.approx(4.0)
    assert set(plane.boundaries) | {"footing"} == set(found.boundaries)


def test_a_part_has_parts(plane: Mesh) -> None:
    parts = {"half": ("top", Region((0.0, 0.0), (2.0, 0.0))), "quarter": ("half", Region((1.0, 0.0), (4.0, 0.0)))}
    assert length(with_boundaries(plane, parts), "quarter") == pytest.approx(1.0)


def test_a_layer_leaves_the_rest_to_the_zone_it_was_in(plane: Mesh) -> None:
    found = with_zones(plane, {"clay": Region((0.0, -1.0), (4.0, -0.5)), "lens": Region((0.0, -1.0), (1.0, -0.5))})
    area = 1.0 / (4.0 if plane.cell_type == "quad8" else 8.0)
    assert {name: len(elements) * area for name, elements in found.zones.items()} == pytest.approx(
        {"all": 6.0, "clay": 1.5, "lens": 0.5}
    )
    assert sorted(np.concatenate(list(found.zones.values()))) == list(range(len(plane.cells)))


def test_a_zone_that_loses_all_is_gone(plane: Mesh) -> None:
    assert list(with_zones(plane, {"sand": Region((0.0, -2.0), (4.0, 0.0))}).zones) == ["sand"]


@pytest.mark.parametrize(
    ("name", "of", "region", "said"),
    [
        ("footing", "top", Region((0.0, -0.1), (0.3, 0.1)), "no facet of 'top' lies between (0, -0.1) and (0.3, 0.1)"),
        ("footing", "topp", Region((0.0, -0.1), (0.3, 0.1)), "no boundary 'topp', did you mean 'top'"),
        ("left", "top", Region((0.0, -0.1), (1.0, 0.1)), "has a boundary 'left' already"),
        ("footing", "top", Region((0.0, 0.0, 0.0), (1.0, 1.0, 0.0)), "corners of 3 axes, and the mesh has 2"),
    ],
)
def test_what_is_no_part(plane: Mesh, name: str, of: str, region: Region, said: str) -> None:
    with pytest.raises(MeshError, match=re.escape(said)):
        with_boundaries(plane, {name: (of, region)})


def test_an_empty_zone_and_one_that_is_there(plane: Mesh) -> None:
    with pytest.raises(MeshError, match="no element lies between"):
        with_zones(plane, {"clay": Region((0.0, 3.0), (1.0, 4.0))})
    with pytest.raises(MeshError, match="has a zone 'all' already"):
        with_zones(plane, {"all": Region((0.0, -1.0), (1.0, 0.0))})


CASE = """
[scene]
kind = "boundary_value"
kinematics = "plane_strain"

[mesh]
box = { lower = [0.0, -2.0], upper = [4.0, 0.0], cells = [8, 4] }
boundary.footing = { of = "top", lower = [0.0, 0.0], upper = [1.0, 0.0] }
zone.soft = { lower = [0.0, -1.0], upper = [4.0, 0.0] }

[material.stiff]
model = "elastic"
youngs_modulus = 1e5
poisson_ratio = 0.3
zones = ["all"]

[material.weak]
model = "elastic"
youngs_modulus = 1e4
poisson_ratio = 0.3
zones = ["soft"]

[[support]]
boundary = ["bottom", "left", "right"]
fix = ["x", "y"]

[[stage]]
name = "load"
kind = "load"
pressure = [{ boundary = "footing", value = 10.0 }]
"""


def test_a_case_names_the_strip_under_its_footing_and_a_layer(tmp_path: Path) -> None:
    file = tmp_path / "case.toml"
    file.write_text(CASE, encoding="utf-8")
    case = read_case(file)
    assert isinstance(case, BoundaryValueCase)
    assert length(mesh_of(case), "footing") == pytest.approx(1.0)
    zones = build(case).model.zones
    assert {name: zone.material.youngs_modulus for name, zone in zones.items()} == {"all": 1e5, "soft": 1e4}


@pytest.mark.parametrize(
    ("wrong", "right", "said"),
    [
        ("upper = [1.0, 0.0]", "upper = [1.0]", "mesh.boundary.footing.upper"),
        ("lower = [0.0, 0.0]", "lower = [2.0, 0.0]", "lower above upper"),
        ('of = "top"', 'of = "tpo"', "did you mean 'top'"),
        ("upper = [1.0, 0.0]", "upper = [0.2, 0.0]", "boundary 'footing' is empty"),
    ],
)
def test_a_wrong_part_gets_a_sentence(wrong: str, right: str, said: str, tmp_path: Path) -> None:
    file = tmp_path / "case.toml"
    file.write_text(CASE.replace(wrong, right), encoding="utf-8")
    with pytest.raises(CaseError, match=re.escape(said)):
        build(read_case(file))  # type: ignore[arg-type]
