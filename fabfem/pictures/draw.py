"""Pictures of the fields of a result, drawn off-screen with pyvista.

Run as ``python -m fabfem.pictures.draw DIR``, in a process of its own: on a machine without off-screen
OpenGL, VTK ends the process instead of raising. Deformation is drawn at its true scale.
"""

import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pyvista
from numpy.typing import NDArray

Array = NDArray[np.float64]

SIZE = (1600, 1000)
WIDE = 1.8
"""Width over height of the part of a picture that shows the scene."""
INK = "#222222"
SATURATED = 96.0
"""Percentile of the shear strain at which the colours end; the corners of a footing strain without bound."""
GLYPHS_ACROSS = 24
"""Fabric glyphs across the picture."""
UNIFORM = 0.02
"""Least span of a colour bar over its largest value: what varies less has about one colour."""
LABELS = 4
"""Intervals between the labels of a colour bar."""
ROUND = np.array([1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 15.0, 20.0])
"""Numbers whose multiples are easily read."""
FINE = 15_000
"""Elements from which their edges would hide what they lie in."""
STRETCH = 1.5
"""Exaggeration of the anisotropy of a fabric glyph."""


class Drawn(NamedTuple):
    """A picture that still has to be framed."""

    plotter: pyvista.Plotter
    """Plotter that holds it."""
    bounds: tuple[float, ...]
    """What it should show."""
    side: Array
    """Where a solid is looked at from, (3,)."""


def draw(folder: Path) -> list[Path]:
    """Draw the pictures that the last stored increment has fields for, and return their files."""
    grid = _last(folder)
    deformed = moved_to(grid) if "displacement" in grid.point_data else grid
    plotter, title = _plotter(), _title(folder)
    pictures = [_shoot(_shear(plotter, deformed), title, folder / "shear_strain.png")]
    if {"displacement_increment", "strain_increment"} <= set(grid.point_data.keys()):
        plotter = _plotter()
        pictures.append(
            _shoot(_mechanism(plotter, grid), f"{title}; what the last increment adds", folder / "mechanism.png")
        )
    if "fabric" in grid.point_data:
        plotter = _plotter()
        pictures.append(_shoot(_fabric(plotter, deformed), title, folder / "fabric.png"))
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
        surface, scalars="shear", cmap="OrRd", clim=colours, scalar_bar_args=_bar(title), lighting=False
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
        scalar_bar_args=_bar("shear strain of the increment, relative"),
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


def busy(grid: pyvista.UnstructuredGrid, upper: float) -> tuple[float, ...]:
    """Return the bounds (x0, x1, y0, y1, z0, z1) of where the soil shears, with a margin, within those of the grid."""
    active = grid.points[grid["shear"] > 0.1 * upper]
    whole = np.array(grid.bounds).reshape(3, 2)
    if grid_is_solid(grid) or len(active) == 0:
        return grid.bounds
    low, high = active.min(axis=0), active.max(axis=0)
    margin = 0.3 * np.max(high - low)
    low, high = np.maximum(whole[:, 0], low - margin), np.minimum(whole[:, 1], high + margin)
    wider = max(0.0, (high - low)[1] * WIDE - (high - low)[0])
    low[0], high[0] = max(whole[0, 0], low[0] - wider), min(whole[0, 1], high[0] + wider)
    return tuple(np.stack([low, high], axis=1).ravel())


def _fabric(plotter: pyvista.Plotter, grid: pyvista.UnstructuredGrid) -> Drawn:
    """Draw the density of contacts as ellipsoids, long where contact normals gather."""
    bounds = busy(grid, max(float(np.nanpercentile(grid["shear"], SATURATED)), 1e-12))
    outline = _cropped(grid.extract_surface(nonlinear_subdivision=2, algorithm="dataset_surface"), bounds)
    whole = outline.extract_surface(algorithm="dataset_surface").clean(tolerance=1e-6)  # cropping parts the elements
    solid = grid_is_solid(grid)
    edge = whole.extract_feature_edges(manifold_edges=False, feature_edges=solid)
    plotter.add_mesh(outline, color="#f4f1ea", lighting=False, opacity=0.2 if solid else 1.0)
    plotter.add_mesh(edge, color=INK, line_width=2)
    glyphs = pyvista.merge(list(_glyphs(grid, bounds)))
    plotter.add_mesh(
        glyphs,
        scalars="norm",
        cmap="viridis",
        clim=span(glyphs["norm"].min(), glyphs["norm"].max()),
        scalar_bar_args=_bar("norm of the fabric anisotropy F; ellipses are long where contact normals point"),
        lighting=solid,
    )
    return Drawn(plotter, bounds, facing(grid))


def _glyphs(grid: pyvista.UnstructuredGrid, bounds: tuple[float, ...]) -> Iterator[pyvista.PolyData]:
    spacing = max(bounds[1] - bounds[0], WIDE * (bounds[3] - bounds[2])) / GLYPHS_ACROSS
    ball = pyvista.Sphere(radius=1.0, theta_resolution=36, phi_resolution=19)
    centres, fabric = sampled(grid, bounds, spacing)
    for centre, tensor in zip(centres, fabric, strict=True):
        shape = np.eye(3) + STRETCH * tensor
        glyph = ball.copy()
        glyph.points = (centre + 0.45 * spacing * ball.points @ shape / np.linalg.norm(shape, 2)).astype(np.float32)
        glyph["norm"] = np.full(glyph.n_points, np.linalg.norm(tensor))
        yield glyph


def sampled(grid: pyvista.UnstructuredGrid, bounds: tuple[float, ...], spacing: float) -> tuple[Array, Array]:
    """Return places on a regular lattice that lie well in the grid, and the fabric tensors there."""
    low, high = np.array(bounds).reshape(3, 2).T
    axes = [np.arange(a + spacing / 2, b, spacing) if b > a else np.array([a]) for a, b in zip(low, high, strict=True)]
    lattice = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    straight = grid.linear_copy()
    inside = np.ones(len(lattice), dtype=bool)
    for direction in np.vstack([np.eye(3), -np.eye(3)]) * (high > low):
        inside &= np.asarray(straight.find_containing_cell(lattice + 0.4 * spacing * direction)) >= 0
    probed = pyvista.PolyData(lattice[inside]).sample(straight, tolerance=1e-6 * grid.length)
    good = np.isfinite(probed["fabric"]).all(axis=1) & (probed["vtkValidPointMask"] > 0)
    shown = good & near_faces(lattice[inside], spacing, facing(grid)) if grid_is_solid(grid) else good
    return lattice[inside][shown], tensors(probed["fabric"][shown])


def near_faces(places: Array, spacing: float, side: Array) -> NDArray[np.bool_]:
    """Return which places of a lattice lie in the outermost layer of either upright face that is looked at."""
    outermost = np.where(side < 0.0, places.min(axis=0), places.max(axis=0))
    return (np.abs(places - outermost)[:, :2] < 0.5 * spacing).any(axis=1)


def facing(grid: pyvista.UnstructuredGrid) -> Array:
    """Return where to look from at a solid (3,): from above, at the upright faces next to where it shears most."""
    weights = np.nan_to_num(grid["shear"]) ** 2
    middle = 0.5 * (grid.points.min(axis=0) + grid.points.max(axis=0))
    towards = weights @ (grid.points - middle) / max(float(weights.sum()), 1e-300)
    return np.array([-1.0 if towards[0] < 0.0 else 1.0, -1.0 if towards[1] < 0.0 else 1.0, 0.6])


def span(low: float, high: float) -> tuple[float, float]:
    """Return where the colours of values from low to high begin and end, so that all labels between are round."""
    least = max(high - low, UNIFORM * max(abs(low), abs(high)), 1e-12) / LABELS
    power = 10.0 ** np.floor(np.log10(least))
    for step in power * ROUND:
        first = step * np.floor(low / step * (1.0 + 1e-9))
        if step >= least * (1.0 - 1e-9) and first + LABELS * step >= high * (1.0 - 1e-9):
            break
    return float(first), float(first + LABELS * step)


def tensors(components: Array) -> Array:
    """Return (n, 3, 3) tensors of (n, 6) components in VTK's order XX YY ZZ XY YZ XZ."""
    return np.asarray(components, float)[:, [0, 3, 5, 3, 1, 4, 5, 4, 2]].reshape(-1, 3, 3)


def shear_strain(strain: Array) -> Array:
    """Return the (n,) shear strain sqrt(2/3 e:e) of (n, 6) components in VTK's order, e the deviator."""
    full = tensors(strain)
    deviator = full - np.trace(full, axis1=1, axis2=2)[:, None, None] * np.eye(3) / 3.0
    return np.sqrt(2.0 / 3.0 * np.einsum("nij,nij->n", deviator, deviator))


def grid_is_solid(grid: pyvista.UnstructuredGrid) -> bool:
    """Return whether the grid has an extent in all three directions."""
    return bool(grid.bounds[5] > grid.bounds[4])


def _plotter() -> pyvista.Plotter:
    plotter = pyvista.Plotter(off_screen=True, window_size=SIZE)
    plotter.set_background("white")
    return plotter


def _bar(title: str) -> dict[str, object]:
    return {
        "title": title + "\n",
        "color": INK,
        "title_font_size": 30,
        "label_font_size": 26,
        "fmt": "%.4g",
        "position_x": 0.25,
        "position_y": 0.03,
        "width": 0.5,
        "height": 0.085,
    }


def _shoot(drawn: Drawn, title: str, picture: Path) -> Path:
    """Frame the scene between its title and the colour bar, and write the picture."""
    plotter, bounds, side = drawn
    text = plotter.add_text(title, position=(0.02, 0.91), viewport=True, font_size=12, color=INK)
    text.GetTextProperty().SetLineSpacing(1.25)
    if bounds[5] > bounds[4]:
        plotter.view_vector(side, viewup=(0.0, 0.0, 1.0))
        plotter.camera.zoom(0.9)
        plotter.camera.SetWindowCenter(0.0, -0.16)  # above the colour bar
        plotter.add_axes(color=INK)
    else:
        plotter.view_xy()
        plotter.enable_parallel_projection()
        _fit(plotter, bounds)
    plotter.screenshot(picture)
    plotter.close()
    return picture


def _fit(plotter: pyvista.Plotter, bounds: tuple[float, ...]) -> None:
    """Fill the picture with a flat scene, less a strip below for the colour bar and one above for the title."""
    x0, x1, y0, y1 = bounds[:4]
    half = max((y1 - y0) / 2 / 0.72, (x1 - x0) / 2 * SIZE[1] / SIZE[0] / 0.96)
    centre = ((x0 + x1) / 2, (y0 + y1) / 2 - 0.07 * half)
    plotter.camera.parallel_scale = half
    plotter.camera.focal_point = (*centre, 0.0)
    plotter.camera.position = (*centre, 10.0 * half)


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
