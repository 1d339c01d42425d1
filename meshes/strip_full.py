"""Make strip_full.msh: a whole strip footing B = 1 m on level ground, 8-node quadrilaterals.

The domain is 6 B wide and 2.5 B deep, enough for a mechanism in clay, the surface at y = 0, the footing's base
-0.5 ≤ x ≤ 0.5 m. Elements are finest at the footing's edges. Needs gmsh (``pip install gmsh``):
``python meshes/strip_full.py [FILE]``.
"""

import sys
from pathlib import Path

import gmsh

HALF, WIDE, DEEP = 0.5, 3.0, 2.5
FINE, COARSE, REACH = 0.028, 0.25, 1.5
"""Element size at the edges and far away, and the distance at which it is that of far away [m]."""


def draw() -> None:
    """Draw the domain and name its parts."""
    add = gmsh.model.geo
    corners = [(-WIDE, -DEEP), (WIDE, -DEEP), (WIDE, 0.0), (HALF, 0.0), (-HALF, 0.0), (-WIDE, 0.0)]
    points = [add.addPoint(x, y, 0) for x, y in corners]
    lines = [add.addLine(a, b) for a, b in zip(points, [*points[1:], points[0]], strict=True)]
    ground = add.addPlaneSurface([add.addCurveLoop(lines)])
    add.synchronize()
    bottom, right, beside, footing, other, left = lines
    named = {"bottom": [bottom], "right": [right], "left": [left], "footing": [footing], "surface": [beside, other]}
    for name, members in named.items():
        gmsh.model.addPhysicalGroup(1, members, name=name)
    gmsh.model.addPhysicalGroup(2, [ground], name="soil")
    field = gmsh.model.mesh.field
    distance, size = field.add("Distance"), field.add("Threshold")
    field.setNumbers(distance, "PointsList", [points[3], points[4]])
    for option, value in (
        ("InField", distance),
        ("SizeMin", FINE),
        ("SizeMax", COARSE),
        ("DistMin", 0.05),
        ("DistMax", REACH),
    ):
        field.setNumber(size, option, value)
    field.setAsBackgroundMesh(size)
    for option in ("MeshSizeExtendFromBoundary", "MeshSizeFromPoints", "MeshSizeFromCurvature"):
        gmsh.option.setNumber(f"Mesh.{option}", 0)


def main(path: Path) -> None:
    """Write the mesh to `path`."""
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    draw()
    gmsh.option.setNumber("Mesh.RecombineAll", 1)
    gmsh.option.setNumber("Mesh.RecombinationAlgorithm", 3)  # blossom, quadrilaterals only
    gmsh.option.setNumber("Mesh.SecondOrderIncomplete", 1)
    gmsh.model.mesh.generate(2)
    gmsh.model.mesh.setOrder(2)
    gmsh.write(str(path))
    gmsh.finalize()


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).with_suffix(".msh"))
