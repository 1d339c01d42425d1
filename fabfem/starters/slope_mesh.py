"""Write the mesh of a slope that falls to the right, its toe at the origin: quadrilaterals along the face.

Called by fabfem as ``python slope_mesh.py FILE name=value ...`` with the parameters of the case. The boundaries are
left, right, bottom, crest, face and toe (the level ground before it); the zone above the toe is slope, below it ground.
"""

import sys

import meshio
import numpy as np


def block(number: np.ndarray) -> np.ndarray:
    """Return the quadrilaterals between rows of nodes, the lowest row first."""
    return np.stack([number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]], axis=-1).reshape(-1, 4)


def draw(
    file: str,
    height: float = 10.0,
    angle: float = 45.0,
    behind: float = 12.0,
    before: float = 8.0,
    depth: float = 5.0,
    size: float = 1.25,
) -> None:
    """Write a mesh of elements of about one size: `behind` the crest, `before` the toe, `depth` below the toe."""
    run = height / np.tan(np.radians(angle))
    up, down = (np.linspace(0.0, 1.0, max(1, round(length / size)) + 1) for length in (height, depth))
    back = np.linspace(0.0, 1.0, max(1, round((behind + run / 2) / size)) + 1)
    front = np.linspace(0.0, before, max(1, round(before / size)) + 1)
    left, under = -behind - run, np.append(back * (behind + run) - behind - run, front[1:])
    lower = [(x, (row - 1.0) * depth) for row in down for x in under]
    upper = [(left + part * (behind + run * (1.0 - row)), row * height) for row in up[1:] for part in back]
    ground = np.arange(len(lower)).reshape(len(down), len(under))
    above = len(lower) + np.arange(len(upper)).reshape(len(up) - 1, len(back))
    slope = np.vstack([ground[-1, : len(back)], above])
    sides = {
        "left": np.append(ground[:, 0], above[:, 0]),
        "right": ground[:, -1],
        "bottom": ground[0],
        "crest": slope[-1],
        "face": slope[:, -1],
        "toe": ground[-1, len(back) - 1 :],
    }
    edges = [np.stack([nodes[:-1], nodes[1:]], axis=1) for nodes in sides.values()]
    parts = [*edges, block(slope), block(ground)]
    tags = [np.full(len(part), tag) for tag, part in enumerate(parts, 1)]
    areas = {"slope": np.array([len(sides) + 1, 2]), "ground": np.array([len(sides) + 2, 2])}
    names = {name: np.array([tag, 1]) for tag, name in enumerate(sides, 1)} | areas
    points = np.column_stack([np.array(lower + upper), np.zeros(len(lower) + len(upper))])
    blocks = [("quad" if part.shape[1] == 4 else "line", part) for part in parts]
    data = {"gmsh:physical": tags, "gmsh:geometrical": tags}
    meshio.Mesh(points, blocks, cell_data=data, field_data=names).write(file, file_format="gmsh22", binary=False)


if __name__ == "__main__":
    draw(sys.argv[1], **{name: float(value) for name, _, value in (word.partition("=") for word in sys.argv[2:])})
