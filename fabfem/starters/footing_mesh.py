"""Write the mesh of a strip footing, half or whole: quadrilaterals, finest at the edge of the footing.

Called by fabfem as ``python footing_mesh.py FILE name=value ...`` with the parameters of the case; x = 0 is the plane
of symmetry and y = 0 the surface. The boundaries are symmetry (in the half alone), bottom, side, footing and surface,
the zone is soil.
"""

import sys

import meshio
import numpy as np

GROWTH = 1.4
"""Size of an element over that of its neighbour nearer to the footing."""


def away(start: float, end: float, first: float) -> np.ndarray:
    """Return coordinates from start to end, the first step about `first`, the others ever longer."""
    count = max(1, round(np.log1p((GROWTH - 1) * abs(end - start) / first) / np.log(GROWTH)))
    steps = GROWTH ** np.arange(count)
    return start + (end - start) * np.concatenate([[0.0], np.cumsum(steps) / steps.sum()])


def draw(
    file: str, width: float = 1.0, reach: float = 4.0, depth: float = 4.0, elements: float = 4.0, whole: float = 0.0
) -> None:
    """Write a mesh with so many elements below half the footing, `depth` deep, from x = 0 to `reach`.

    With `whole` = 1 it begins at x = -`reach`, and has no plane of symmetry.
    """
    half = 0.5 * width
    if not (0.0 < half < reach and depth > 0.0 and elements >= 1.0 and elements == round(elements)):
        raise SystemExit("it needs 0 < width/2 < reach, depth > 0, and elements a whole number of 1 or more")
    size = half / elements
    x = np.concatenate([np.linspace(0.0, half, round(elements) + 1), away(half, reach, size)[1:]])
    right = x
    if whole:
        x = np.concatenate([-x[:0:-1], x])
    y = away(0.0, -depth, size)
    number = np.arange(len(x) * len(y)).reshape(len(y), len(x))
    a, b, c, d = number[1:, :-1], number[1:, 1:], number[:-1, 1:], number[:-1, :-1]
    middle = len(x) - len(right)  # column of x = 0
    begin, end = (middle - round(elements) if whole else 0), middle + round(elements)
    top, left = number[0], number[:, 0]
    sides = {
        "bottom": [number[-1]],
        "side": [number[:, -1], left] if whole else [number[:, -1]],
        "footing": [top[begin : end + 1]],
        "surface": [top[end:], top[: begin + 1]] if whole else [top[end:]],
    } | ({} if whole else {"symmetry": [left]})
    edges = [np.concatenate([np.stack([line[:-1], line[1:]], axis=1) for line in side]) for side in sides.values()]
    cells = np.stack([a, b, c, d], axis=-1).reshape(-1, 4)
    tags = [np.full(len(part), tag) for tag, part in enumerate([*edges, cells], 1)]
    points = np.stack(np.broadcast_arrays(x[None, :], y[:, None], 0.0), axis=-1).reshape(-1, 3)
    names = {name: np.array([tag, 1]) for tag, name in enumerate(sides, 1)} | {"soil": np.array([len(tags), 2])}
    blocks = [*(("line", part) for part in edges), ("quad", cells)]
    data = {"gmsh:physical": tags, "gmsh:geometrical": tags}
    meshio.Mesh(points, blocks, cell_data=data, field_data=names).write(file, file_format="gmsh22", binary=False)


if __name__ == "__main__":
    draw(sys.argv[1], **{name: float(value) for name, _, value in (word.partition("=") for word in sys.argv[2:])})
