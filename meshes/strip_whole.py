"""Make a mesh of a whole strip footing B = 0.9 m on level ground, 6-node triangles, for inclined bedding.

Twice `strip_half.py`: 5 B to each side and 5 B deep, the surface at y = 0, the footing's base -0.45 ≤ x ≤ 0.45 m. The
boundaries are left, right, bottom, surface and footing. Elements are finest at the footing's edges; ``size=2`` doubles
all of them. Needs gmsh (``pip install gmsh``): ``python meshes/strip_whole.py FILE [size=1]``.
"""

import sys
from pathlib import Path

import gmsh
from strip_half import COARSE, DEPTH, FINE, FOOTING, GROWTH, HALF, WIDTH


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


def main(path: Path, size: float = 1.0) -> None:
    """Write the mesh to `path`, with elements `size` times as large as usual."""
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    draw(size)
    gmsh.model.mesh.generate(2)
    gmsh.model.mesh.setOrder(2)
    gmsh.write(str(path))
    gmsh.finalize()


if __name__ == "__main__":
    sizes = [float(word.removeprefix("size=")) for word in sys.argv[2:]]
    main(Path(sys.argv[1]), *sizes)
