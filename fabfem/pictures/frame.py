"""How a picture of fields is framed: what it shows, from where, and the colours beside it."""

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
UNIFORM = 0.02
"""Least span of a colour bar over its largest value: what varies less has about one colour."""
LABELS = 4
"""Intervals between the labels of a colour bar."""
ROUND = np.array([1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 15.0, 20.0])
"""Numbers whose multiples are easily read."""


class Drawn(NamedTuple):
    """A picture that still has to be framed."""

    plotter: pyvista.Plotter
    """Plotter that holds it."""
    bounds: tuple[float, ...]
    """What it should show."""
    side: Array
    """Where a solid is looked at from, (3,)."""


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


def facing(grid: pyvista.UnstructuredGrid) -> Array:
    """Return where to look from at a solid (3,): from above, at the upright faces next to where it shears most."""
    weights = np.nan_to_num(grid["shear"]) ** 2
    middle = 0.5 * (grid.points.min(axis=0) + grid.points.max(axis=0))
    towards = weights @ (grid.points - middle) / max(float(weights.sum()), 1e-300)
    return np.array([-1.0 if towards[0] < 0.0 else 1.0, -1.0 if towards[1] < 0.0 else 1.0, 0.6])


def grid_is_solid(grid: pyvista.UnstructuredGrid) -> bool:
    """Return whether the grid has an extent in all three directions."""
    return bool(grid.bounds[5] > grid.bounds[4])


def span(low: float, high: float) -> tuple[float, float]:
    """Return where the colours of values from low to high begin and end, so that all labels between are round."""
    least = max(high - low, UNIFORM * max(abs(low), abs(high)), 1e-12) / LABELS
    power = 10.0 ** np.floor(np.log10(least))
    for step in power * ROUND:
        first = step * np.floor(low / step * (1.0 + 1e-9))
        if step >= least * (1.0 - 1e-9) and first + LABELS * step >= high * (1.0 - 1e-9):
            break
    return float(first), float(first + LABELS * step)


def blank() -> pyvista.Plotter:
    """Return a white picture."""
    plotter = pyvista.Plotter(off_screen=True, window_size=SIZE)
    plotter.set_background("white")
    return plotter


def bar(title: str) -> dict[str, object]:
    """Return where the colour bar is and what it looks like."""
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


def shoot(drawn: Drawn, title: str, picture: Path) -> Path:
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
