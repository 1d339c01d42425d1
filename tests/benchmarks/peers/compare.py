"""The footings by fabfem and by its peers, in turn, and how fabfem's cost grows: tables of docs/performance.md.

    python tests/benchmarks/peers/compare.py --dofs 5k 20k 81k --repeats 3 --pip PYTHON --skfem python --ccx python
    python tests/benchmarks/peers/compare.py --dofs solid-50k solid-150k --repeats 3
    python tests/benchmarks/peers/compare.py --growth --repeats 3

Wall times are medians, processor times and memory the least; each over fabfem's first row. Each size has a table of its
own in the page, which is replaced; with `--dry` it is printed only. `--dolfinx`, `--pip`, `--skfem` and `--ccx` name
the interpreters that have what the scripts need (dolfinx: /usr/bin/python3 after `apt install python3-dolfinx
libopenblas0-pthread`; FElupe, OpenSees and NGSolve: one after `pip install felupe pypardiso openseespy ngsolve`;
CalculiX: any with numpy, after `apt install calculix-ccx`); what is not there is left out.
`--growth` fits time and memory of 5k to 300k unknowns by a power, and tells the phases at 81k with one thread and two;
`--sizes` and `--threads-at` make it smaller.
"""

import argparse
import json
import os
import statistics
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from shutil import which

sys.path.insert(0, str(Path(__file__).parents[1]))

from page import write_table

HERE = Path(__file__).parent
TWO = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "2")


def run(command: list[str]) -> dict:
    """Return the last line of a program as a record; empty where it failed."""
    path = os.environ | TWO | {"PYTHONPATH": str(HERE.parents[2]) if "footing.py" in command[1] else ""}
    done = subprocess.run(command, env=path, capture_output=True, text=True, check=False)
    lines = [line for line in done.stdout.splitlines() if line.startswith("{")]
    if done.returncode or not lines:
        print(" ".join(command), "failed:", done.stderr[-300:], file=sys.stderr)
        return {}
    return json.loads(lines[-1])


def ours(dofs: str, *more: str) -> list[str]:
    """Return the command that runs fabfem."""
    return [sys.executable, str(HERE.parent / "footing.py"), "--dofs", dofs, *more]


def programs(asked: argparse.Namespace, dofs: str) -> list[list[str]]:
    """Return the commands of all programs, fabfem's first."""
    commands, peers = [ours(dofs)], [(asked.dolfinx, "dolfinx_run.py", "gamg")]
    if not dofs.startswith("solid"):
        commands += [ours(dofs, "--material", "ch"), ours(dofs, "--solver", "superlu")]
        peers = [(asked.dolfinx, "dolfinx_run.py", kind) for kind in ("lu", "cholesky")]
        peers += [(asked.pip, f"{name}_run.py") for name in ("felupe", "opensees", "ngsolve")]
        peers += [(asked.skfem, "skfem_run.py"), (asked.ccx, "ccx_run.py")]
    for interpreter, script, *more in peers:
        if which(interpreter):
            commands.append([interpreter, str(HERE / script), dofs, *more])
    return commands


def compare(asked: argparse.Namespace, dofs: str) -> Iterator[str]:
    """Yield the table of all programs."""
    yield "| program | dofs | wall s | ratio | processor s | ratio | peak MB | solves | settlement m | load |"
    yield "|" + "---|" * 10
    commands = programs(asked, dofs)
    rows = [[run(command) for command in commands] for _ in range(asked.repeats)]
    first: list[float] = []
    for at, command in enumerate(commands):
        done = [row[at] for row in rows if row[at]]
        if not done:
            continue
        name = " ".join([done[0]["program"], done[0].get("material", ""), "superlu" * ("superlu" in command)])
        times = statistics.median(d["wall_s"] for d in done), min(d["cpu_s"] for d in done)
        first = first or list(times)
        cells = [name.strip(), done[0]["dofs"]]
        for taken, fabfem in zip(times, first, strict=True):
            cells += [f"{taken:.2f}", f"{taken / fabfem:.1f}"]
        cells += [f"{min(d['peak_mb'] for d in done):.0f}", done[0]["iterations"], f"{done[0]['settlement_m']:.7f}"]
        yield f"| {' | '.join(map(str, cells))} | {max(d['load_average'] for d in done):.0f} |"


def growth(asked: argparse.Namespace) -> Iterator[str]:
    """Yield time and memory by the number of unknowns, and the phases by the number of threads."""
    import numpy as np

    rows = [[run(ours(dofs, "--clock", "processor")) for dofs in asked.sizes] for _ in range(asked.repeats)]
    dofs = [row["dofs"] for row in rows[0]]
    yield f"| dofs | {' | '.join(map(str, dofs))} | power |"
    yield "|" + "---|" * (len(dofs) + 2)
    for what in ("wall_s", "cpu_s", "peak_mb"):
        values = [min(row[at][what] for row in rows) for at in range(len(dofs))]
        power = np.polyfit(np.log(dofs), np.log(values), 1)[0]
        yield f"| {what} | {' | '.join(f'{value:.2f}' for value in values)} | {power:.2f} |"
    for material in ("von_mises", "ch"):
        yield from threads(asked, material)
    yield f"\nLoad average {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores."


def threads(asked: argparse.Namespace, material: str) -> Iterator[str]:
    """Yield the share of each phase, and what two threads gain."""
    size = asked.threads_at
    commands = [ours(size, "--material", material, "--threads", n) for n in ("1", "2")]
    rows = [[run(command) for command in commands] for _ in range(asked.repeats)]
    one, two = (
        {phase: min(row[at]["phases_s"][phase] for row in rows) for phase in rows[0][at]["phases_s"]} for at in (0, 1)
    )
    yield f"\n| {material}, {size} | share with 1 thread | wall s, 1 thread | wall s, 2 threads | gain |"
    yield "|" + "---|" * 5
    for phase in (*one, "whole"):
        first, second = (times.get(phase) or sum(times.values()) for times in (one, two))
        share = 100.0 * first / sum(one.values())
        yield f"| {phase} | {share:.0f} % | {first:.2f} | {second:.2f} | {first / second:.2f} |"


def publish(asked: argparse.Namespace, name: str, rows: Iterator[str]) -> None:
    """Print the rows of a table as they come, and put them into the page."""
    lines = []
    for row in rows:
        print(row, flush=True)
        lines.append(row)
    if not asked.dry:
        write_table("performance.md", f"footing {name}", lines)


def main() -> None:
    """Read the command line and run."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--dofs", nargs="+", default=["5k", "20k", "81k"])
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--dolfinx", default="/usr/bin/python3")
    parser.add_argument("--pip", default="")
    parser.add_argument("--skfem", default="")
    parser.add_argument("--ccx", default="")
    parser.add_argument("--growth", action="store_true")
    parser.add_argument("--sizes", nargs="+", default=["5k", "20k", "81k", "300k"])
    parser.add_argument("--threads-at", default="81k")
    parser.add_argument("--dry", action="store_true", help="leave the page as it is")
    asked = parser.parse_args()
    if asked.growth:
        publish(asked, "growth", growth(asked))
    else:
        for dofs in asked.dofs:
            publish(asked, dofs, compare(asked, dofs))


if __name__ == "__main__":
    main()
