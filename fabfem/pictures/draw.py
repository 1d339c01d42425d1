"""Pictures of the fields of a result, drawn off-screen with pyvista.

Run as ``python -m fabfem.pictures.draw DIR``, in a process of its own: on a machine without off-screen
OpenGL, VTK ends the process instead of raising. Deformation is drawn at its true scale.
"""

import json
import sys
from pathlib import Path

import numpy as np
import pyvista
from numpy.typing import NDArray

from fabfem.pictures.frame import INK, Array, Drawn, bar, blank, busy, facing, grid_is_solid, shoot, span
from fabfem.pictures.glyphs import GLYPHS_ACROSS, ellipsoids, tensors

SATURATED = 96.0
"""Percentile of the shear strain at which the colours end; the corners of a footing strain without bound."""
FINE = 15_000
"""Elements from which their edges would hide what they lie in."""


def draw(folder: Path) -> list[Path]:
    """Draw the pictures that the last stored increment has fields for, and return their files."""
    grid = _last(folder)
    deformed = moved_to(grid) if "displacement" in grid.point_data else grid
    plotter, title = blank(), _title(folder)
    pictures = [shoot(_shear(plotter, deformed), title, folder / "shear_strain.png")]
    if {"displacement_increment", "strain_increment"} <= set(grid.point_data.keys()):
        plotter = blank()
        pictures.append(
            shoot(_mechanism(plotter, grid), f"{title}; what the last increment adds", folder / "mechanism.png")
        )
    if "fabric" in grid.point_data:
        plotter = blank()
        pictures.append(shoot(_fabric(plotter, deformed), title, folder / "fabric.png"))
    return pictures


def _last(folder: Path) -> pyvista.UnstructuredGrid:
    reader = pyvista.get_reader(folder / "fields.pvd")
    reader.set_active_time_point(reader.number_time_points - 1)
    return reader.read()[0]


def moved_to(grid: pyvista.UnstructuredGrid) -> pyvista.UnstructuredGrid:
    """Return the grid where it has moved to; of a section through a twisted body, only what it moves in its plane."""
    moved = np.array(grid.point_data["displacement"])
    if not grid_is_solid(grid):
        moved[:, 2] = 0.0
    found = grid.copy()
    found.points = grid.points + moved
    return found


def _shear(plotter: pyvista.Plotter, grid: pyvista.UnstructuredGrid) -> Drawn:
    """Draw the deformed mesh, coloured by shear strain where strain was stored, else by displacement."""
    if "strain" in grid.point_data:
        grid["shear"], title = 100.0 * shear_strain(grid.point_data["strain"]), "shear strain [%]"
    else:
        shown = grid.point_data.get("displacement", np.zeros((grid.n_points, 3)))
        grid["shear"], title = np.linalg.norm(shown, axis=1), "displacement"
    upper = max(float(np.nanpercentile(grid["shear"], SATURATED)), 1e-12)
    colours, most = span(0.0, upper), float(np.nanmax(grid["shear"]))
    if "strain" in grid.point_data and most > colours[1]:
        title += f"; darkest at {colours[1]:.4g} and above, the most is {most:.3g}"
    bounds = busy(grid, upper)
    surface = _cropped(grid.extract_surface(nonlinear_subdivision=2, algorithm="dataset_surface"), bounds)
    body = plotter.add_mesh(
        surface, scalars="shear", cmap="OrRd", clim=colours, scalar_bar_args=bar(title), lighting=False
    )
    body.mapper.resolve = "polygon_offset"  # edges lie on it
    body.mapper.SetRelativeCoincidentTopologyPolygonOffsetParameters(4.0, 4.0)
    if grid.n_cells < FINE:
        edges = _cropped(grid.linear_copy().extract_all_edges(), bounds)
        plotter.add_mesh(edges, color=INK, line_width=1, opacity=0.3)
    return Drawn(plotter, bounds, facing(grid))


def _mechanism(plotter: pyvista.Plotter, grid: pyvista.UnstructuredGrid) -> Drawn:
    """Draw how the body moves in the last increment: arrows over the shear strain, both relative to the largest."""
    sheared = shear_strain(grid.point_data["strain_increment"])
    grid["shear"] = sheared / max(float(np.nanpercentile(sheared, SATURATED)), 1e-300)
    bounds = grid.bounds
    surface = grid.extract_surface(nonlinear_subdivision=2, algorithm="dataset_surface")
    plotter.add_mesh(
        surface,
        scalars="shear",
        cmap="OrRd",
        clim=(0.0, 1.0),
        scalar_bar_args=bar("shear strain of the increment, relative"),
        lighting=False,
    )
    moved = np.linalg.norm(grid.point_data["displacement_increment"], axis=1)
    chosen = grid.extract_points(_spread(grid, bounds) & (moved > 0.02 * moved.max()), include_cells=False)
    longest = 1.5 * max(bounds[1] - bounds[0], bounds[3] - bounds[2]) / GLYPHS_ACROSS
    arrows = chosen.glyph(orient="displacement_increment", scale="displacement_increment", factor=longest / moved.max())
    plotter.add_mesh(arrows, color=INK, lighting=False)
    return Drawn(plotter, bounds, facing(grid))


def _spread(grid: pyvista.UnstructuredGrid, bounds: tuple[float, ...]) -> NDArray[np.bool_]:
    """Return a mask of nodes that lie about evenly: the first in each cell of a lattice."""
    spacing = max(bounds[1] - bounds[0], bounds[3] - bounds[2]) / (2 * GLYPHS_ACROSS)
    cells = np.floor((grid.points - grid.points.min(axis=0)) / spacing).astype(np.int64)
    _, first = np.unique(cells, axis=0, return_index=True)
    mask = np.zeros(grid.n_points, bool)
    mask[first] = True
    return mask


def _cropped(surface: pyvista.PolyData, bounds: tuple[float, ...]) -> pyvista.DataSet:
    """Return the part of a flat surface that lies within the bounds; a solid's surface is left whole."""
    if bounds[5] > bounds[4]:
        return surface
    return surface.clip_box((*bounds[:4], bounds[4] - 1.0, bounds[5] + 1.0), invert=False)


def _fabric(plotter: pyvista.Plotter, grid: pyvista.UnstructuredGrid) -> Drawn:
    """Draw the density of contacts as ellipsoids, long where contact normals gather."""
    bounds = busy(grid, max(float(np.nanpercentile(grid["shear"], SATURATED)), 1e-12))
    outline = _cropped(grid.extract_surface(nonlinear_subdivision=2, algorithm="dataset_surface"), bounds)
    whole = outline.extract_surface(algorithm="dataset_surface").clean(tolerance=1e-6)  # cropping parts the elements
    solid = grid_is_solid(grid)
    edge = whole.extract_feature_edges(manifold_edges=False, feature_edges=solid)
    plotter.add_mesh(outline, color="#f4f1ea", lighting=False, opacity=0.2 if solid else 1.0)
    plotter.add_mesh(edge, color=INK, line_width=2)
    glyphs = pyvista.merge(list(ellipsoids(grid, bounds)))
    plotter.add_mesh(
        glyphs,
        scalars="norm",
        cmap="viridis",
        clim=span(glyphs["norm"].min(), glyphs["norm"].max()),
        scalar_bar_args=bar("norm of the fabric anisotropy F; ellipses are long where contact normals point"),
        lighting=solid,
    )
    return Drawn(plotter, bounds, facing(grid))


def shear_strain(strain: Array) -> Array:
    """Return the (n,) shear strain sqrt(2/3 e:e) of (n, 6) components in VTK's order, e the deviator."""
    full = tensors(strain)
    deviator = full - np.trace(full, axis1=1, axis2=2)[:, None, None] * np.eye(3) / 3.0
    return np.sqrt(2.0 / 3.0 * np.einsum("nij,nij->n", deviator, deviator))


def _title(folder: Path) -> str:
    """Return the case's title and the time of the picture."""
    report = json.loads((folder / "report.json").read_text(encoding="utf-8"))
    named = report["title"] or report["case"]
    if not report["increments"]:
        return str(named)
    safety = report.get("factor_of_safety")
    if safety and safety["first_failure"]:
        return f"{named}\n{safety['verdict']} with the strength divided by {safety['first_failure']:.4g}"
    end = report["increments"][-1]
    return f"{named}\n{end['stage']} {100.0 * end['fraction']:.0f} % done, deformed at true scale"


if __name__ == "__main__":
    draw(Path(sys.argv[1]))
