"""What needs no MPI of a shared run: owners of facets, values dealt out anew, pieces of fields that make one."""

import re
import tomllib
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from fabfem.fem.box import box_mesh
from fabfem.fem.kinematics import KINEMATICS
from fabfem.fem.mesh import owners
from fabfem.fem.porous_space import porous
from fabfem.fem.share import Share, carried, share_of
from fabfem.fem.solve import Progress
from fabfem.fem.space import build_space
from fabfem.fem.start import Start
from fabfem.fem.trial import Equilibrium
from fabfem.output.vtu import FieldPieces, Frame


class State(NamedTuple):
    """A state of a material."""

    stress: np.ndarray
    last: np.ndarray
    """Named as an array of dofs is elsewhere, which must not matter."""


SPACE = porous(build_space(box_mesh("quad8", (4, 3), (0, 0), (4, 3)), KINEMATICS["plane_strain"]))


def part(elements: np.ndarray, order: np.random.Generator) -> Share:
    """Return a share of some elements, its nodes in any order."""
    nodes = np.unique(SPACE.mesh.cells[elements])
    corners = np.intersect1d(nodes, SPACE.pressure_nodes)
    zones = {"left": elements[elements % 4 < 2], "right": elements[elements % 4 >= 2]}
    return Share(elements, order.permutation(nodes), corners, zones, SPACE.nq, 2)


def numbered(share: Share) -> Start:
    """Return a start whose every entry is made of its number in the whole mesh."""
    points, dofs = share.numbers("points") + 0.5, share.numbers("dofs") + 0.25
    states = {
        name: State(np.outer(own, np.arange(6.0)), own)
        for name, own in ((name, share.numbers(f"zone:{name}") + 0.75) for name in share.zones)
    }
    now = Equilibrium(dofs, states, 2.0 * dofs, points[:, None, None] * np.ones((6, 6)))
    return Start("push", 1, 7, 0.5, now, 3.0 * dofs, Progress(0.5, 0.1, dofs))


def same(one: object, other: object) -> None:
    """Compare records and their arrays."""
    if isinstance(one, np.ndarray):
        np.testing.assert_array_equal(one, other)
    elif isinstance(one, dict):
        assert one.keys() == other.keys()  # type: ignore[attr-defined]
        for key, value in one.items():
            same(value, other[key])  # type: ignore[index]
    elif isinstance(one, tuple):
        assert type(one) is type(other)
        for a, b in zip(one, other, strict=True):  # type: ignore[call-overload]
            same(a, b)
    else:
        assert one == other


@pytest.mark.parametrize(("n", "m"), [(1, 3), (3, 2), (4, 1)])
def test_the_shares_of_n_processes_are_dealt_out_to_m(n: int, m: int) -> None:
    order = np.random.default_rng(n)
    elements = order.permutation(12)
    pieces = [part(np.sort(some), order) for some in np.array_split(elements, n)]
    for some in np.array_split(order.permutation(elements), m):
        here = part(np.sort(some), order)
        found = carried(((piece, numbered(piece)) for piece in pieces), here)
        same(found, numbered(here))


def test_one_process_has_all() -> None:
    mesh = replace(SPACE.mesh, zones={"all": np.arange(12)})
    share = share_of(replace(SPACE, mesh=mesh))
    assert len(share.numbers("dofs")) == SPACE.ndof
    assert len(np.unique(share.numbers("dofs"))) == SPACE.ndof
    np.testing.assert_array_equal(share.numbers("zone:all"), np.arange(SPACE.npoints))


@pytest.mark.parametrize("cell_type", ["quad8", "triangle", "hexahedron", "tetra10"])
def test_a_facet_belongs_to_an_element_that_has_its_nodes(cell_type: str) -> None:
    dim = 3 if cell_type in ("hexahedron", "tetra10") else 2
    mesh = box_mesh(cell_type, (3,) * dim, (0,) * dim, (1,) * dim)
    for facets in mesh.boundaries.values():
        cells = mesh.cells[owners(mesh, facets)]
        assert (facets[:, :, None] == cells[:, None, :]).any(axis=2).all()


def test_pieces_of_fields_make_one(tmp_path: Path) -> None:
    import pyvista

    mesh = SPACE.mesh
    for rank, elements in enumerate((np.arange(5), np.arange(5, 12))):
        nodes, cells = np.unique(mesh.cells[elements], return_inverse=True)
        parts = mesh.points[nodes], cells.reshape(len(elements), -1), mesh.cell_type
        files = FieldPieces(rank, 2, tmp_path, *parts, "a note")
        x = mesh.points[nodes, 0]
        tensor = np.outer(elements, np.arange(6.0))
        files.write(Frame(2.0, {"x": x, "u": np.outer(x, [1.0, 2.0, 3.0])}, {"stress": tensor}))
    reader = pyvista.get_reader(tmp_path / "fields.pvd")
    assert reader.time_values == [2.0]
    whole = reader.read()[0]
    assert whole.n_cells == 12
    np.testing.assert_allclose(whole["x"], whole.points[:, 0], rtol=1e-6)
    np.testing.assert_allclose(whole["stress"][:, 2], 2.0 * np.arange(12), rtol=1e-6)


def test_no_scene_with_a_mesh_is_forgotten_in_the_comparison() -> None:
    """Each has a row in docs/parallel.md; ``python tests/benchmarks/ranks.py --write 'the same answer'`` makes it."""
    home = Path(__file__).parents[3]
    cases = {f"{path.parent.name}/{path.stem}": path.read_text("utf-8") for path in (home / "cases").glob("*/*.toml")}
    meshed = {name for name, text in cases.items() if tomllib.loads(text)["scene"]["kind"] == "boundary_value"}
    page = (home / "docs" / "parallel.md").read_text("utf-8")
    part = page.partition("<!-- the same answer -->")[2].partition("<!-- end -->")[0]
    assert set(re.findall(r"^\| `([\w/]+)` \|", part, re.MULTILINE)) == meshed
