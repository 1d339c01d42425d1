"""Strong and weak scaling of a three-dimensional footing on shared processes: the second table of docs/parallel.md.

``python tests/benchmarks/ranks_scaling.py strong`` takes 50 000 unknowns on 1 and on 2 ranks, ``weak`` 50 000 on one
and 100 000 on two. Each settles a square footing on sand, a quarter of the scene, by a millimetre in two increments
after the geostatic stage, and prints a row for a run: time by phase (the largest of a rank) and in all, the processor
time of all ranks together, memory and points by rank, linear iterations over solves, MiB sent by each rank, and
imbalance. The load of the machine before the run stands in the last column: the times are those of a free machine where
it is below about 0.3. ``--unknowns``, ``--ranks``, ``--material`` and ``--linear`` change what is run.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import meshio
import numpy as np

HOME = Path(__file__).parents[2]
CALM = {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1", "OMPI_MCA_mpi_yield_when_idle": "1"}
CALM |= {"OMPI_MCA_rmaps_base_oversubscribe": "1", "OMPI_MCA_hwloc_base_binding_policy": "none"}
CASE = """
title = "A quarter of a square footing, 1 m, on dry Toyoura sand"
[scene]
kind = "boundary_value"
kinematics = "solid"
[mesh]
file = "block.inp"
order = 2
[material.sand]
unit_weight = 15.3
{material}
[solver]
tolerance = 3e-3
viscosity = 2e-4
held = 0.005
linear = "{linear}"
[[support]]
boundary = "bottom"
fix = ["x", "y", "z"]
[[support]]
boundary = "sides_x"
fix = ["x"]
[[support]]
boundary = "sides_y"
fix = ["y"]
[[stage]]
name = "geostatic"
kind = "geostatic"
k0 = 0.5
surcharge = 1.0
pressure = [{{ boundary = ["surface", "footing"], value = 1.0 }}]
[[stage]]
name = "settlement"
kind = "load"
displacement = [{{ boundary = "footing", x = 0.0, y = 0.0, z = -0.001 }}]
increments = {{ initial = 0.5, minimum = 1e-3, maximum = 0.5 }}
[[reaction]]
name = "footing_force"
boundary = "footing"
component = "z"
"""
MATERIALS = {
    "sand": """
model = "chang_hicher"
preset = "toyoura"
void_ratio = 0.69
fabric = { law = "zhao_kruyt", norm = 0.208, bedding_angle = 0.0 }
[material.sand.parameters]
open_pressure = 1e-3
max_evaluations = 1000
""",
    "elastic": 'model = "elastic"\nyoungs_modulus = 20000.0\npoisson_ratio = 0.3',
}
"""What the ground is made of: with the elastic one, the cost is that of the equations alone."""


RUNS = {
    "strong": ((50000, 1), (50000, 2)),
    "weak": ((50000, 1), (100000, 2)),
}
"""Unknowns and ranks of each run."""
HEAD = (
    *("solver", "material", "unknowns", "ranks", "material [s]", "assembly [s]", "linear solve [s]", "all [s]"),
    *("processor [s]", "memory [MiB]", "points of each", "iterations / solves", "sent [MiB]", "imbalance", "load"),
)


def counts(unknowns: int) -> tuple[int, int, int]:
    """Return the elements along each axis of a block of about so many unknowns, some 14 of them to an element."""
    wide = 4 * max(1, round((unknowns / 10.5) ** (1 / 3) / 4))  # the footing ends at a quarter of the width
    return wide, wide, max(2, round(unknowns / (14 * wide**2)))


def block(counts: tuple[int, int, int]) -> meshio.Mesh:
    """Return hexahedra of 2 m × 2 m × 1.5 m, the footing a quarter of the top's width."""
    sizes = (2.0, 2.0, 1.5)
    axes = [np.linspace(0.0, size, count + 1) for size, count in zip(sizes, counts, strict=True)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3) - [0.0, 0.0, 1.5]
    number = np.arange(len(points)).reshape(np.array(counts) + 1)
    shift = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
    a, b, c = counts
    cells = np.stack([number[i : i + a, j : j + b, k : k + c].ravel() for i, j, k in shift], axis=1)
    x, y, z = points.T
    under = (np.abs(z) < 1e-9) & (x < 0.5 + 1e-9) & (y < 0.5 + 1e-9)
    over = (np.abs(z) < 1e-9) & ((x > 0.5 - 1e-9) | (y > 0.5 - 1e-9))
    sets = {"footing": under, "surface": over, "bottom": np.abs(z + 1.5) < 1e-9}
    sets |= {"sides_x": (x < 1e-9) | (x > 2 - 1e-9), "sides_y": (y < 1e-9) | (y > 2 - 1e-9)}
    sets = {name: np.flatnonzero(inside) for name, inside in sets.items()}
    return meshio.Mesh(points, [("hexahedron", cells)], point_sets=sets)


def row(linear: str, unknowns: int, ranks: int, material: str) -> str:
    """Return the row of a run."""
    with tempfile.TemporaryDirectory() as home:
        meshio.write(Path(home) / "block.inp", block(counts(unknowns)))
        case = Path(home) / "case.toml"
        case.write_text(CASE.format(linear=linear, material=MATERIALS[material]), encoding="utf-8")
        words = [sys.executable, "-m", "fabfem", "solve", str(case), "--out", f"{home}/out", "--quiet"]
        here = os.environ | CALM | {"PYTHONPATH": str(HOME)}
        load, before = os.getloadavg()[0], os.times()
        done = subprocess.run(
            ["mpiexec", "-n", str(ranks), *words], env=here, capture_output=True, text=True, check=False
        )
        if done.returncode:
            return f"{linear} {unknowns} {ranks}: {(done.stderr + done.stdout).strip()[:300]}"
        after = os.times()
        report = json.loads((Path(home) / "out" / "report.json").read_text(encoding="utf-8"))
    found = report["ranks"]
    spent = after.children_user + after.children_system - before.children_user - before.children_system
    parts = [
        *(linear, material, int(sum(found["unknowns"])), ranks),
        *(f"{max(found[phase]):.1f}" for phase in ("material", "assembly", "linear_solve")),
        *(f"{report['wall_time']['total']:.0f}", f"{spent:.0f}"),
        *("/".join(f"{part:.0f}" for part in found[what]) for what in ("peak_memory", "points")),
        f"{found['linear_iterations'][0]:.0f} / {found['solves'][0]:.0f}",
        "/".join(f"{part / 2**20:.2f}" for part in found["exchanged"]),
        f"{found['imbalance']['elements']}",
        f"{load:.1f}",
    ]
    return "| " + " | ".join(map(str, parts)) + " |"


def main() -> None:
    """Run what the command line says."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("what", nargs="?", choices=RUNS, default="strong")
    parser.add_argument("--linear", nargs="+", default=["multigrid"])
    parser.add_argument("--unknowns", type=int, nargs="+")
    parser.add_argument("--ranks", type=int, nargs="+", default=[1, 2])
    parser.add_argument("--material", choices=MATERIALS, default="sand")
    said = parser.parse_args()
    runs = [(unknowns, ranks) for unknowns in said.unknowns or () for ranks in said.ranks] or RUNS[said.what]
    print("| " + " | ".join(HEAD) + " |\n|" + "---|" * len(HEAD))
    for linear in said.linear:
        for unknowns, ranks in runs:
            print(row(linear, unknowns, ranks, said.material), flush=True)


if __name__ == "__main__":
    main()
