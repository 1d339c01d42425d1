"""Make strip_half.msh: half of a strip footing B = 0.9 m on level ground, 6-node triangles.

The domain is 5 B wide and 5 B deep, the surface at y = 0, the footing's base 0 ≤ x ≤ 0.45 m. Elements are finest at
the footing's edge; ``size=0.5`` halves all of them, ``order=1`` makes 3-node triangles. Needs gmsh (``pip install
gmsh``): ``python meshes/strip_half.py [FILE [size=1] [order=2]]``.
"""

import sys
from collections.abc import Callable
from pathlib import Path

import gmsh

HALF = 0.45
WIDTH = DEPTH = 5 * 2 * HALF
FINE, FOOTING, COARSE, GROWTH = 0.045, 0.05, 0.45, 0.085
"""Element size at the footing's edge (B/20), below the footing, and far away [m]; growth with the distance [-]."""


def draw(size: float) -> None:
    """Draw the domain and name its parts, with elements `size` times as large as usual."""
    add = gmsh.model.geo
    corners = [(0, 0), (0, -DEPTH), (WIDTH, -DEPTH), (WIDTH, 0), (HALF, 0)]
    points = [add.addPoint(x, y, 0) for x, y in corners]
    lines = [add.addLine(a, b) for a, b in zip(points, [*points[1:], points[0]], strict=True)]
    ground = add.addPlaneSurface([add.addCurveLoop(lines)])
    add.synchronize()
    for name, line in zip(("symmetry", "bottom", "side", "surface", "footing"), lines, strict=True):
        gmsh.model.addPhysicalGroup(1, [line], name=name)
    gmsh.model.addPhysicalGroup(2, [ground], name="soil")
    grade(points[4:], lines[4], size)


def grade(edges: list[int], footing: int, factor: float) -> None:
    """Let the element size grow with the distance from the footing and from its edges."""
    field = gmsh.model.mesh.field
    sizes = []
    for what, tags, start in (("PointsList", edges, FINE), ("CurvesList", [footing], FOOTING)):
        distance = field.add("Distance")
        field.setNumbers(distance, what, tags)
        field.setNumber(distance, "Sampling", 200)
        size = field.add("MathEval")
        field.setString(size, "F", f"{factor} * Min({start} + {GROWTH} * F{distance}, {COARSE})")
        sizes.append(size)
    smallest = field.add("Min")
    field.setNumbers(smallest, "FieldsList", sizes)
    field.setAsBackgroundMesh(smallest)
    for option in ("MeshSizeExtendFromBoundary", "MeshSizeFromPoints", "MeshSizeFromCurvature"):
        gmsh.option.setNumber(f"Mesh.{option}", 0)


def main(draw: Callable[[float], None], path: Path, size: float = 1.0, order: float = 2.0) -> None:
    """Write the mesh of a drawing to `path`, with elements `size` times as large as usual and of an order."""
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    draw(size)
    gmsh.model.mesh.generate(2)
    gmsh.model.mesh.setOrder(int(order))
    gmsh.write(str(path))
    gmsh.finalize()


if __name__ == "__main__":
    said = {name: float(value) for name, _, value in (word.partition("=") for word in sys.argv[2:])}
    main(draw, Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).with_suffix(".msh"), **said)
