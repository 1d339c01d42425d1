"""The strip footing of the comparison by CalculiX and SPOOLES; `apt install calculix-ccx`.

python tests/benchmarks/peers/ccx_run.py 81k

CPE6 elements, geometrically linear, ten fixed increments; the tolerance on the residual is set to 1e-8. The time is
that of the whole program, reading its input and writing the settlement included.
"""

import re
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from grid import CUTS, HARDENING, POISSON, PRESSURE, YIELD, YOUNG, report, triangles, with_middles


def lines(rows):
    """Return rows of numbers as lines."""
    return "\n".join(", ".join(map(str, row)) for row in rows)


def deck(cuts):
    """Return CalculiX's input, and the number of unknowns in the plane."""
    points, cells = with_middles(*triangles(cuts))
    x, y = points.T
    sets = {"SIDES": np.isclose(x, 0.0) | np.isclose(x, 7.0), "BOTTOM": np.isclose(y, -3.6)}
    centre = int(np.argmin(np.abs(points).sum(axis=1))) + 1
    faces = []  # face P1 of CPE6 lies between its corners 1 and 2
    for k in range(3):
        ends = cells[:, [k, (k + 1) % 3]]
        under = np.isclose(y[ends], 0.0).all(axis=1) & (x[ends] < 1.0 + 1e-9).all(axis=1)
        faces += [f"{e + 1}, P{k + 1}, {PRESSURE}" for e in np.flatnonzero(under)]
    nodes = lines([(i + 1, *row, 0.0) for i, row in enumerate(points.tolist())])
    elements = lines([(e + 1, *row) for e, row in enumerate((cells + 1).tolist())])
    named = "\n".join(
        f"*NSET, NSET={n}\n" + lines((i + 1,) for i in np.flatnonzero(s).tolist()) for n, s in sets.items()
    )
    loads = "\n".join(faces)
    text = f"""*NODE, NSET=ALL
{nodes}
*ELEMENT, TYPE=CPE6, ELSET=SOIL
{elements}
{named}
*NSET, NSET=CENTRE
{centre}
*MATERIAL, NAME=METAL
*ELASTIC
{YOUNG}, {POISSON}
*PLASTIC
{YIELD}, 0.0
{YIELD + HARDENING}, 1.0
*SOLID SECTION, ELSET=SOIL, MATERIAL=METAL
1.0
*BOUNDARY
SIDES, 1, 1
BOTTOM, 1, 2
*STEP, NLGEOM=NO, INC=100
*STATIC, DIRECT, SOLVER=SPOOLES
0.1, 1.0
*CONTROLS, PARAMETERS=FIELD
1e-8, 1e-6, , , 1e-8, , , 1e-8
*DLOAD
{loads}
*NODE PRINT, NSET=CENTRE, FREQUENCY=10
U
*END STEP
"""
    return text, 2 * len(points)


def solve(cuts):
    """Return unknowns, seconds, settlement, iterations and seconds of processor time."""
    text, dofs = deck(cuts)
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "footing.inp").write_text(text)
        begin = time.perf_counter()
        done = subprocess.run(["ccx", "footing"], cwd=folder, capture_output=True, text=True, check=False)
        wall = time.perf_counter() - begin
        if done.returncode:
            raise SystemExit(done.stdout[-400:] + done.stderr)
        row = Path(folder, "footing.dat").read_text().split("\n")
    settlement = -float([line.split() for line in row if len(line.split()) == 4 and "disp" not in line][-1][2])
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return (
        dofs,
        wall,
        settlement,
        len(re.findall(r"^ iteration +\d+", done.stdout, re.M)),
        used.ru_utime + used.ru_stime,
    )


dofs, wall, settlement, iterations, processor = solve(CUTS[sys.argv[1]])
version = subprocess.run(["ccx", "-v"], capture_output=True, text=True, check=False).stdout.split()[-1]
report(f"CalculiX {version} (SPOOLES)", dofs, wall, settlement, iterations, processor, resource.RUSAGE_CHILDREN)
