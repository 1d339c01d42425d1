"""The strip footing of the comparison by OpenSees and UMFPACK; `pip install openseespy` in its own environment.

python tests/benchmarks/peers/opensees_run.py 81k

Elements tri6n, material J2Plasticity, OpenSees' own Newton and load control. Its test knows no force that grows
with the load: each increment is solved to 1e-8 of the norm of the load then, a little more strictly than elsewhere.
"""

import sys
import time

import numpy as np
import openseespy.opensees as ops
from grid import BULK, CUTS, HARDENING, PRESSURE, SHEAR, YIELD, report, strip_load, triangles, with_middles


def solve(cuts):
    """Return unknowns, seconds, settlement, iterations and seconds of processor time."""
    begin, used = time.perf_counter(), time.process_time()
    points, cells = with_middles(*triangles(cuts))
    build(points, cells)
    strip, shares = strip_load(points, cuts)
    for node, share in zip(strip.tolist(), shares.tolist(), strict=True):
        ops.load(node + 1, 0.0, -PRESSURE * share)
    ops.constraints("Plain")
    ops.numberer("RCM")
    ops.system("UmfPack")
    ops.integrator("LoadControl", 0.1)
    ops.algorithm("Newton")
    iterations = 0
    for increment in range(1, 11):
        ops.test("NormUnbalance", 1e-8 * PRESSURE * np.linalg.norm(shares) * increment / 10.0, 30)
        if increment == 1:
            ops.analysis("Static")
        if ops.analyze(1):
            raise SystemExit(f"no equilibrium in increment {increment}")
        iterations += ops.testIter()
    settlement = -ops.nodeDisp(int(np.argmin(np.abs(points).sum(axis=1))) + 1, 2)
    wall, used = time.perf_counter() - begin, time.process_time() - used
    ops.wipe()
    return 2 * len(points), wall, settlement, iterations, used


def build(points, cells):
    """Make OpenSees' model, with an empty load pattern."""
    ops.wipe()
    ops.model("basic", "-ndm", 2, "-ndf", 2)
    for number, at in enumerate(points.tolist(), 1):
        ops.node(number, *at)
    x, y = points.T
    bottom, side = np.isclose(y, -3.6), np.isclose(x, 0.0) | np.isclose(x, 7.0)
    for node in np.flatnonzero(bottom | side).tolist():
        ops.fix(node + 1, 1, int(bottom[node]))
    ops.nDMaterial("J2Plasticity", 1, BULK, SHEAR, YIELD, YIELD, 0.0, HARDENING)
    for number, nodes in enumerate((cells + 1).tolist(), 1):
        ops.element("tri6n", number, *nodes, 1.0, "PlaneStrain", 1)
    ops.timeSeries("Linear", 1)
    ops.pattern("Plain", 1, 1)


solve(1)
dofs, wall, settlement, iterations, processor = solve(CUTS[sys.argv[1]])
report(f"OpenSees {ops.version()} + UMFPACK", dofs, wall, settlement, iterations, processor)
