"""Whether several processes that share a scene find what one finds: the first table of docs/parallel.md.

``python tests/benchmarks/ranks.py [SCENE ...]`` runs the shipped scenes, each for its first increments, alone and on 1,
2 and 3 ranks of ``mpiexec``, and prints a row for each. A difference is the largest over all rows of a column, over
the largest value of the columns with that unit: a force that is zero by symmetry is round-off of the others.
"""

import argparse
import csv
import json
import os
import subprocess
import sys
import tempfile
from itertools import islice
from pathlib import Path

import numpy as np

HOME = Path(__file__).parents[2]
SCENES = [
    *("footing/strip_toyoura", "footing/strip_toyoura_bedding", "footing/strip_toyoura_undrained"),
    *("footing/strip_toyoura_gmsh", "footing/strip_toyoura_abaqus", "footing/circular_toyoura"),
    *("footing/inclined_clay", "footing/eccentric_clay", "specimen/triaxial_rough", "specimen/biaxial_band"),
    *("hollow_cylinder/torsion", "hollow_cylinder/thin_wall", "slope/dawson", "slope/acads_1a"),
    *("slope/griffiths_lane_1", "slope/toyoura_bedding", "slope/toyoura_crest_load"),
    *("studies/lame", "studies/strip_von_mises"),
]
LEFT_OUT = ("errors", "study", "sweep")
"""Tables that a shared run does not take: the mesh's error needs the whole mesh."""
QUIET = {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1", "OMPI_MCA_mpi_yield_when_idle": "1"}
QUIET |= {"OMPI_MCA_rmaps_base_oversubscribe": "1", "OMPI_MCA_hwloc_base_binding_policy": "none"}


def run(case: Path, folder: Path, increments: int | None) -> int:
    """Run the first increments of a scene in this process, or as one of several; return an exit status."""
    sys.path.insert(0, str(HOME))
    import fabfem.boundary_value.run as boundary_value
    from fabfem.case import case_from, read_tables
    from fabfem.parallel.world import ended_together
    from fabfem.run import run_case

    march = boundary_value.march
    if increments:
        boundary_value.march = lambda model, start=None: islice(march(model, start), increments)
    tables = {name: table for name, table in read_tables(case).items() if name not in LEFT_OUT}
    with ended_together(traceback=True):
        outcome = run_case(case_from(tables, case), folder, quiet=True)
    return 0 if outcome.status in ("completed", "stopped") else 1


def begun(ranks: int, case: Path, folder: Path, increments: int | None) -> subprocess.CompletedProcess[str]:
    """Run a scene in processes of their own; none of MPI where `ranks` is 0."""
    launcher = ["mpiexec", "-n", str(ranks)] if ranks else []
    words = [sys.executable, __file__, "--run", str(case), str(folder), "--increments", str(increments or 0)]
    return subprocess.run([*launcher, *words], env=os.environ | QUIET, capture_output=True, text=True, check=False)


def rows(folder: Path) -> tuple[list[str], list[list[str]]]:
    """Return the header and the rows of a history."""
    with (folder / "history.csv").open(encoding="utf-8") as file:
        header, *lines = csv.reader(file)
    return header, lines


def difference(one: Path, other: Path) -> float:
    """Return the largest difference of two histories, infinite where they have other rows."""
    (header, a), (again, b) = rows(one), rows(other)
    if header != again or len(a) != len(b) or [row[0] for row in a] != [row[0] for row in b]:
        return np.inf
    one_, other_ = (np.array([[float(value or "nan") for value in row[1:]] for row in table]) for table in (a, b))
    units = [name.partition("[")[2] for name in header[1:]]
    found = 0.0
    for unit in set(units):
        columns = [place for place, own in enumerate(units) if own == unit]
        gap = np.nan_to_num(np.abs(one_[:, columns] - other_[:, columns])).max()
        found = max(found, gap / max(np.nanmax(np.abs(one_[:, columns])), 1e-300))
    return float(found)


def compared(scene: str, numbers: list[int], increments: int | None) -> dict[str, object]:
    """Return the row of a scene: what was run, how far each number of ranks is from one process, and the imbalance."""
    case = Path(scene) if scene.endswith(".toml") else HOME / "cases" / f"{scene}.toml"
    found: dict[str, object] = {"scene": scene}
    with tempfile.TemporaryDirectory() as home:
        for ranks in (0, *numbers):
            folder = Path(home) / str(ranks)
            done = begun(ranks, case, folder, increments)
            if done.returncode:
                lines = [
                    line for line in (done.stderr + done.stdout).splitlines() if "fabfem:" in line or "Error" in line
                ]
                found[f"{ranks} ranks"] = lines[0] if lines else f"status {done.returncode}"
                continue
            report = json.loads((folder / "report.json").read_text(encoding="utf-8"))
            if ranks == 0:
                found |= {"rows": len(rows(folder)[1]), "status": report["status"]}
                continue
            found[f"{ranks} ranks"] = difference(Path(home) / "0", folder)
            found[f"imbalance on {ranks}"] = report["ranks"]["imbalance"].get("elements")
    return found


def table(row: dict[str, object], numbers: list[int]) -> str:
    """Return a row as the document has it."""
    shown = [row["scene"], row.get("rows"), *(row.get(f"{n} ranks") for n in numbers)]
    shown += [", ".join(str(row[f"imbalance on {n}"]) for n in numbers if n > 1 and f"imbalance on {n}" in row)]
    return "| " + " | ".join(f"{part:.0e}" if isinstance(part, float) else str(part) for part in shown) + " |"


def main() -> int:
    """Run what the command line says."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenes", nargs="*", default=SCENES)
    parser.add_argument("--ranks", type=int, nargs="+", default=[1, 2, 3])
    parser.add_argument("--increments", type=int, default=8)
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--run", nargs=2, type=Path, metavar=("CASE", "FOLDER"), help=argparse.SUPPRESS)
    said = parser.parse_args()
    if said.run:
        return run(*said.run, said.increments)
    for scene in said.scenes:
        row = compared(scene, said.ranks, said.increments)
        print(json.dumps(row) if said.json else table(row, said.ranks), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
