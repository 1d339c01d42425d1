"""Whether several processes that share a scene find what one finds: the first table of docs/parallel.md.

``python tests/benchmarks/ranks.py [SCENE ...] [--increments N] [--minutes M]`` runs the shipped scenes to their end, or
for their first increments, alone and on 1, 2 and 3 ranks of ``mpiexec``, one run at a time, and prints a row for each.
Runs that are in `results/ranks` already are not repeated, so it goes on where it was stopped; ``--minutes 0`` runs
nothing and prints the table of what is there. A run that takes longer than ``--minutes`` is ended and compared as far
as it came.

A difference is the largest over all rows of a column, over the largest value of the columns with that unit: a force
that is zero by symmetry is round-off of the others. Where it passes 10⁻⁸ the last row before that is named, and where
they are not the same the first row with another number of iterations. `superlu` is the run of one process with SuperLU
in place of PARDISO: what the scene makes of another round-off, without any ranks. ``--set solver.tolerance=1e-10``, or
``--set material.sand.parameters.tolerance=1e-5``, with a ``--folder`` of its own runs the scenes with other settings.
"""

import argparse
import csv
import json
import os
import re
import subprocess
import sys
import tomllib
from itertools import islice
from pathlib import Path
from shutil import rmtree

import numpy as np
from page import write_table

HOME = Path(__file__).parents[2]
LIMIT = 1e-8
"""Difference that is asked for."""
COUNTS = ("increment", "iterations")
"""Columns that count; they are the same or not."""
ALONE, OTHER = "alone", "superlu"
HEADINGS = "| scene | increments | {} | imbalance of elements |"
QUIET = {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1", "OMPI_MCA_mpi_yield_when_idle": "1"}
QUIET |= {"OMPI_MCA_rmaps_base_oversubscribe": "1", "OMPI_MCA_hwloc_base_binding_policy": "none"}


def scenes() -> list[str]:
    """Return the cases that have a mesh, of which none is forgotten."""
    every = sorted((HOME / "cases").glob("*/*.toml"))
    meshed = [path for path in every if tomllib.loads(path.read_text("utf-8"))["scene"]["kind"] == "boundary_value"]
    return [f"{path.parent.name}/{path.stem}" for path in meshed]


def run(case: Path, folder: Path, increments: int, changes: list[str]) -> int:
    """Run the first increments of a scene in this process, or as one of several; return an exit status."""
    sys.path.insert(0, str(HOME))
    import fabfem.boundary_value.run as boundary_value
    from fabfem.case import case_from, read_tables
    from fabfem.parallel.world import ended_together
    from fabfem.run import run_case
    from fabfem.study.variants import with_value

    march = boundary_value.march
    if increments:
        boundary_value.march = lambda model, start=None: islice(march(model, start), increments)
    tables = read_tables(case)
    for place, value in (change.split("=", 1) for change in changes):
        tables = with_value(tables, place, json.loads(value))
    with ended_together(traceback=True):
        outcome = run_case(case_from(tables, case), folder, quiet=True)
        return 0 if outcome.status in ("completed", "stopped") else 1
    return 0  # a rank without work


def begun(name: str, case: Path, folder: Path, said: argparse.Namespace) -> str:
    """Run a scene in processes of their own, for some time at most; return why there is no result, or nothing."""
    rmtree(folder, ignore_errors=True)  # of a run that was cut short
    folder.mkdir(parents=True)
    launcher = ["mpiexec", "-n", name] if name.isdigit() else []
    words = [sys.executable, __file__, "--run", str(case), str(folder), "--increments", str(said.increments)]
    changes = [*said.set, f'solver.linear="{OTHER}"'] if name == OTHER else said.set
    words += ["--set", *changes] if changes else []
    before = os.times()
    with (folder / "said").open("w", encoding="utf-8") as log:
        process = subprocess.Popen([*launcher, *words], env=os.environ | QUIET, stdout=log, stderr=log)
        try:
            status: int | None = process.wait(60.0 * said.minutes)
        except subprocess.TimeoutExpired:
            process.terminate()
            process.wait()
            status = None
    after, told = os.times(), (folder / "said").read_text(encoding="utf-8")
    spent = after.children_user + after.children_system - before.children_user - before.children_system
    reasons = re.findall(r"^(?:fabfem|[\w.]*Error): (.*)", told, re.MULTILINE)
    why = (reasons or [f"status {status}"])[0] if status else ""
    ended = {"whole": status == 0, "increments": said.increments, "why": why, "processor": round(spent, 1)}
    (folder / "ended.json").write_text(json.dumps(ended), encoding="utf-8")
    return why


def rows(folder: Path) -> tuple[list[str], list[list[str]]]:
    """Return the header and the rows of a history, whole ones only."""
    with (folder / "history.csv").open(encoding="utf-8") as file:
        header, *lines = csv.reader(file)
    return header, [line for line in lines if len(line) == len(header)]


def differences(one: Path, other: Path) -> tuple[np.ndarray, np.ndarray]:
    """Return the largest difference of two histories, row by row, and whether they have the same iterations there.

    Where increments were halved in one of them alone, the other is interpolated in time within a stage.
    """
    (header, a), (again, b) = rows(one), rows(other)
    assert header == again, f"{one} and {other} have not the same columns"
    names, units = zip(*(name.split(" [") for name in header[1:]), strict=True)
    pairs = [_side_by_side(*(_of_stage(lines, stage) for lines in (a, b)), names.index("time")) for stage in _stages(a)]
    one_, other_, same = (np.concatenate(parts) for parts in zip(*pairs, strict=True))
    counts = np.isin(names, COUNTS)
    found = np.zeros(len(one_))
    for unit in set(units):
        columns = [place for place, own in enumerate(units) if own == unit and not counts[place]]
        gap = np.nan_to_num(np.abs(one_[:, columns] - other_[:, columns])).max(axis=1, initial=0.0)
        found = np.maximum(found, gap / max(np.nanmax(np.abs(one_[:, columns]), initial=0.0), 1e-300))
    return found, same & (one_[:, counts] == other_[:, counts]).all(axis=1)


def _stages(lines: list[list[str]]) -> list[str]:
    return list(dict.fromkeys(line[0] for line in lines))


def _of_stage(lines: list[list[str]], stage: str) -> np.ndarray:
    """Return the numbers of the rows of a stage, NaN where there is none."""
    found = [[float(value or "nan") for value in line[1:]] for line in lines if line[0] == stage]
    return np.array(found).reshape(len(found), -1)


def _side_by_side(a: np.ndarray, b: np.ndarray, time: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return rows of one history, those of the other at the same times, and whether these are rows of its own."""
    n = min(len(a), len(b))
    if n == 0:
        return a[:0], a[:0], np.zeros(0, bool)
    apart = np.abs(a[:n, time] - b[:n, time]) > 1e-9
    if not apart.any():
        return a[:n], b[:n], ~apart
    there = a[:, time] <= b[-1, time] + 1e-9
    own = np.arange(int(there.sum())) < int(apart.argmax())
    return a[there], np.stack([np.interp(a[there, time], b[:, time], column) for column in b.T], axis=1), own


def compared(scene: str, said: argparse.Namespace) -> dict[str, object]:
    """Return the row of a scene: what was run, how far each run is from one process, and the imbalance."""
    case = Path(scene) if scene.endswith(".toml") else HOME / "cases" / f"{scene}.toml"
    home = said.folder / (case.stem if scene.endswith(".toml") else scene)
    found: dict[str, object] = {"scene": scene}
    for name in (ALONE, *said.runs):
        folder = home / name
        if said.minutes and not (folder / "ended.json").exists():
            begun(name, case, folder, said)
        if not (folder / "ended.json").exists():
            continue
        ended = json.loads((folder / "ended.json").read_text(encoding="utf-8"))
        found[f"processor of {name}"] = ended["processor"]
        if ended["why"]:
            found[name] = ended["why"]
        elif name == ALONE:
            found |= {"rows": len(rows(folder)[1]), "whole": ended["whole"] and not ended["increments"]}
        else:
            found[name] = told(home / ALONE, folder, ended["whole"])
        if name.isdigit() and ended["whole"]:
            report = json.loads((folder / "report.json").read_text(encoding="utf-8"))
            found[f"imbalance on {name}"] = report["ranks"]["imbalance"].get("elements")
    return found


def told(one: Path, other: Path, whole: bool) -> str:
    """Return the difference of two runs, how far it is small enough, and how far one of them came."""
    (gaps, alike), n, m = differences(one, other), len(rows(one)[1]), len(rows(other)[1])
    words = [f"{gaps.max(initial=0.0):.0e}"]
    words += [f"to {np.flatnonzero(gaps > LIMIT)[0]}"] if (gaps > LIMIT).any() else []
    words += [f"iterations differ at {np.flatnonzero(~alike)[0] + 1}"] if not alike.all() else []
    words += [f"{m} increments"] if m != n else []
    return ", ".join(words if whole else [*words, "not to its end"])


def table(row: dict[str, object], said: argparse.Namespace) -> str:
    """Return a row as the document has it."""
    count = row.get("rows", row.get(ALONE, "–"))
    imbalance = [str(row[f"imbalance on {n}"]) for n in said.runs if n != "1" and f"imbalance on {n}" in row]
    shown = [f"{'all ' if row.get('whole') else ''}{count}", *(row.get(n, "–") for n in said.runs)]
    return f"| `{row['scene']}` | {' | '.join(map(str, shown))} | {', '.join(imbalance)} |"


def main() -> int:
    """Run what the command line says."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenes", nargs="*", default=scenes())
    parser.add_argument("--runs", nargs="+", default=["1", "2", "3", OTHER], help="numbers of ranks, or superlu")
    parser.add_argument("--increments", type=int, default=0, help="the first increments alone")
    parser.add_argument("--minutes", type=float, default=15.0, help="limit of each run")
    parser.add_argument("--folder", type=Path, default=HOME / "results" / "ranks")
    parser.add_argument("--set", nargs="+", default=[], metavar="PLACE=VALUE", help="in place of what the cases have")
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--write", default="", metavar="NAME", help="place of docs/parallel.md to put the table in")
    parser.add_argument("--run", nargs=2, type=Path, metavar=("CASE", "FOLDER"), help=argparse.SUPPRESS)
    said = parser.parse_args()
    if said.run:
        return run(*said.run, said.increments, said.set)
    lines = []
    for scene in said.scenes:
        row = compared(scene, said)
        lines.append(table(row, said))
        print(json.dumps(row) if said.json else lines[-1], flush=True)
    if said.write:
        heading = HEADINGS.format(" | ".join(said.runs))
        write_table("parallel.md", said.write, [heading, "|---" * (heading.count("|") - 1) + "|", *lines])
    return 0


if __name__ == "__main__":
    sys.exit(main())
