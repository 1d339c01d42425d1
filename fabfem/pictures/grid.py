"""A stored increment as a grid of pyvista."""

from pathlib import Path

import pyvista


def read_grid(file: Path) -> pyvista.UnstructuredGrid:
    """Return the grid of a ``.vtu`` file."""
    return pyvista.read(file)
