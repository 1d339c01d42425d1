"""Make a mesh of a whole strip footing B = 0.9 m on level ground, 6-node triangles, for inclined bedding.

Twice `strip_half.py`: 5 B to each side and 5 B deep, the surface at y = 0, the footing's base -0.45 ≤ x ≤ 0.45 m. The
boundaries are left, right, bottom, surface and footing. Elements are finest at the footing's edges; ``size=2`` doubles
all of them. Needs gmsh (``pip install gmsh``): ``python meshes/strip_whole.py FILE [size=1]``.
"""

import sys
from pathlib import Path

import gmsh
from strip_half import DEPTH, HALF, WIDTH, grade, main


def draw(size: float) -> None:
    """Draw the domain and name its parts, with elements `size` times as large as usual."""
    add = gmsh.model.geo
    corners = [(-WIDTH, -DEPTH), (WIDTH, -DEPTH), (WIDTH, 0), (HALF, 0), (-HALF, 0), (-WIDTH, 0)]
    points = [add.addPoint(x, y, 0) for x, y in corners]
    lines = [add.addLine(a, b) for a, b in zip(points, [*points[1:], points[0]], strict=True)]
    ground = add.addPlaneSurface([add.addCurveLoop(lines)])
    add.synchronize()
    bottom, right, beside, footing, other, left = lines
    named = {"bottom": [bottom], "right": [right], "left": [left], "footing": [footing], "surface": [beside, other]}
    for name, members in named.items():
        gmsh.model.addPhysicalGroup(1, members, name=name)
    gmsh.model.addPhysicalGroup(2, [ground], name="soil")
    grade(points[3:5], footing, size)


if __name__ == "__main__":
    sizes = [float(word.removeprefix("size=")) for word in sys.argv[2:]]
    main(draw, Path(sys.argv[1]), *sizes)
