"""Make the slope meshes: 8-node quadrilaterals, finest where the slip surfaces run.

Every slope falls to the right, its toe at the origin. The boundaries are left, right, bottom, crest, edge (the
part of the crest that a load keeps off, where there is one), face, toe (the level ground before it, where there is
some); the zone above the toe is "slope", below it "ground". Needs gmsh (``pip install gmsh``): ``python meshes/slope.py
[FOLDER [FORMAT]]`` writes one file for each slope of `SLOPES`, in gmsh's format 4.1 (``msh``) or as Abaqus input
(``inp``).
"""

import sys
from pathlib import Path
from typing import NamedTuple

import gmsh


class Slope(NamedTuple):
    """The shape of a slope [m]."""

    height: float
    run: float
    """Horizontal length of the face."""
    crest: float
    """Length of the level ground behind the crest."""
    toe: float = 0.0
    """Length of the level ground before the toe."""
    depth: float = 0.0
    """Depth of the ground below the toe."""
    fine: float = 1.0
    """Element size at the toe and along the face."""
    coarse: float = 2.5
    """Element size far away."""
    setback: float = 0.0
    """Length of the crest next to the face that is a boundary of its own, "edge": a load on the crest keeps off it."""


SLOPES = {
    "slope_2to1": Slope(height=10.0, run=20.0, crest=12.0, fine=0.45, coarse=1.0),
    "slope_2to1_medium": Slope(height=10.0, run=20.0, crest=12.0, fine=0.9, coarse=2.0),
    "slope_2to1_fine": Slope(height=10.0, run=20.0, crest=12.0, fine=0.3, coarse=0.7),
    "slope_2to1_coarse": Slope(height=10.0, run=20.0, crest=10.0, fine=2.0, coarse=2.5),
    "slope_2to1_setback": Slope(height=10.0, run=20.0, crest=12.0, fine=1.4, coarse=2.5, setback=3.0),
    "slope_45": Slope(height=10.0, run=10.0, crest=12.0, toe=8.0, depth=5.0, fine=0.5, coarse=1.5),
    "slope_2to1_ground": Slope(height=10.0, run=20.0, crest=12.0, toe=10.0, depth=5.0, fine=0.6, coarse=1.6),
}


def draw(slope: Slope) -> None:
    """Draw the domain and name its parts."""
    add = gmsh.model.geo
    back = -slope.run - slope.crest
    corners = {
        "a": (back, 0.0),
        "toe": (0.0, 0.0),
        "crest": (-slope.run, slope.height),
        "d": (back, slope.height),
    }
    if slope.setback:
        corners["back"] = (-slope.run - slope.setback, slope.height)
    if slope.depth:
        corners |= {"e": (slope.toe, 0.0), "f": (slope.toe, -slope.depth), "g": (back, -slope.depth)}
    points = {name: add.addPoint(x, y, 0) for name, (x, y) in corners.items()}

    def line(start: str, end: str) -> int:
        return add.addLine(points[start], points[end])

    base, face = line("a", "toe"), line("toe", "crest")
    edge = [line("crest", "back")] if slope.setback else []
    crest, left = line("back" if slope.setback else "crest", "d"), line("d", "a")
    named = {"face": [face], "edge": edge, "crest": [crest], "left": [left], "bottom": [base], "right": []}
    zones = {"slope": add.addPlaneSurface([add.addCurveLoop([base, face, *edge, crest, left])])}
    if slope.depth:
        toe, right, bottom, deep = line("toe", "e"), line("e", "f"), line("f", "g"), line("g", "a")
        zones["ground"] = add.addPlaneSurface([add.addCurveLoop([-base, -deep, -bottom, -right, -toe])])
        named |= {"toe": [toe], "right": [right], "bottom": [bottom], "left": [left, deep]}
    add.synchronize()
    for name, lines in named.items():
        if lines:
            gmsh.model.addPhysicalGroup(1, lines, name=name)
    for name, surface in zones.items():
        gmsh.model.addPhysicalGroup(2, [surface], name=name)
    grade(slope, face)


def grade(slope: Slope, face: int) -> None:
    """Let the element size grow with the distance from the face, beyond the slip surfaces."""
    field = gmsh.model.mesh.field
    distance = field.add("Distance")
    field.setNumbers(distance, "CurvesList", [face])
    field.setNumber(distance, "Sampling", 100)
    size = field.add("Threshold")
    for option, value in (
        ("InField", distance),
        ("SizeMin", slope.fine),
        ("SizeMax", slope.coarse),
        ("DistMin", 0.4 * slope.height),
        ("DistMax", 1.2 * slope.height),
    ):
        field.setNumber(size, option, value)
    field.setAsBackgroundMesh(size)
    for option in ("MeshSizeExtendFromBoundary", "MeshSizeFromPoints", "MeshSizeFromCurvature"):
        gmsh.option.setNumber(f"Mesh.{option}", 0)


def main(folder: Path, suffix: str = "msh") -> None:
    """Write the meshes into `folder`, in the format that `suffix` names."""
    for name, slope in SLOPES.items():
        gmsh.initialize()
        gmsh.option.setNumber("General.Terminal", 0)
        draw(slope)
        gmsh.option.setNumber("Mesh.RecombineAll", 1)
        gmsh.option.setNumber("Mesh.RecombinationAlgorithm", 3)  # blossom, quadrilaterals only
        gmsh.option.setNumber("Mesh.SecondOrderIncomplete", 1)
        gmsh.model.mesh.generate(2)
        gmsh.model.mesh.setOrder(2)
        gmsh.write(str(folder / f"{name}.{suffix}"))
        gmsh.finalize()


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent, *sys.argv[2:3])
