"""The footings by fabfem and by its peers, in turn, and how fabfem's cost grows: tables of docs/performance.md.

    python tests/benchmarks/peers/compare.py --dofs 5k 20k 81k --repeats 3 --felupe /tmp/peers/bin/python
    python tests/benchmarks/peers/compare.py --dofs 20k --repeats 1 --skfem python --ccx python
    python tests/benchmarks/peers/compare.py --dofs solid-50k solid-150k --repeats 1
    python tests/benchmarks/peers/compare.py --growth --repeats 3

Wall times are medians, processor times and memory the least; each over fabfem's first row. `--dolfinx`, `--felupe`,
`--skfem` and `--ccx` name the interpreters that have what the scripts need (dolfinx: /usr/bin/python3 after `apt
install python3-dolfinx libopenblas0-pthread`; CalculiX: any with numpy, after `apt install calculix-ccx`); what is not
there is left out.
`--growth` fits time and memory of 5k to 300k unknowns by a power, and prints the phases at 81k with one thread and two.
"""

import argparse
import json
import os
import statistics
import subprocess
import sys
from pathlib import Path
from shutil import which

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
        peers += [(asked.felupe, "felupe_run.py"), (asked.skfem, "skfem_run.py"), (asked.ccx, "ccx_run.py")]
    for interpreter, script, *more in peers:
        if which(interpreter):
            commands.append([interpreter, str(HERE / script), dofs, *more])
    return commands


def compare(asked: argparse.Namespace) -> None:
    """Print the table of all programs."""
    print("| program | dofs | wall s | ratio | processor s | ratio | peak MB | solves | settlement m | load |")
    print("|" + "---|" * 10)
    for dofs in asked.dofs:
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
            cells = [name, done[0]["dofs"]]
            for taken, fabfem in zip(times, first, strict=True):
                cells += [f"{taken:.2f}", f"{taken / fabfem:.1f}"]
            cells += [f"{min(d['peak_mb'] for d in done):.0f}", done[0]["iterations"], f"{done[0]['settlement_m']:.7f}"]
            print("|", " | ".join(map(str, cells)), f"| {max(d['load_average'] for d in done):.0f} |", flush=True)


def growth(asked: argparse.Namespace) -> None:
    """Print time and memory by the number of unknowns, and the phases by the number of threads."""
    import numpy as np

    sizes = ("5k", "20k", "81k", "300k")
    rows = [[run(ours(dofs, "--clock", "processor")) for dofs in sizes] for _ in range(asked.repeats)]
    dofs = [row["dofs"] for row in rows[0]]
    print("| dofs |", *(f"{n} |" for n in dofs), "power |\n|" + "---|" * 6)
    for what in ("wall_s", "cpu_s", "peak_mb"):
        values = [min(row[at][what] for row in rows) for at in range(len(sizes))]
        power = np.polyfit(np.log(dofs), np.log(values), 1)[0]
        print(f"| {what} |", *(f"{value:.2f} |" for value in values), f"{power:.2f} |")
    for material in ("von_mises", "ch"):
        threads(asked.repeats, material)
    print(f"\nload average {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")


def threads(repeats: int, material: str) -> None:
    """Print the share of each phase at 81k unknowns, and what two threads gain."""
    commands = [ours("81k", "--material", material, "--threads", n) for n in ("1", "2")]
    rows = [[run(command) for command in commands] for _ in range(repeats)]
    one, two = (
        {phase: min(row[at]["phases_s"][phase] for row in rows) for phase in rows[0][at]["phases_s"]} for at in (0, 1)
    )
    print(f"\n| {material}, 81k | share with 1 thread | wall s, 1 thread | wall s, 2 threads | gain |\n|" + "---|" * 5)
    for phase in (*one, "whole"):
        first, second = (times.get(phase) or sum(times.values()) for times in (one, two))
        share = 100.0 * first / sum(one.values())
        print(f"| {phase} | {share:.0f} % | {first:.2f} | {second:.2f} | {first / second:.2f} |", flush=True)


def main() -> None:
    """Read the command line and run."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--dofs", nargs="+", default=["5k", "20k", "81k"])
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--dolfinx", default="/usr/bin/python3")
    parser.add_argument("--felupe", default="")
    parser.add_argument("--skfem", default="")
    parser.add_argument("--ccx", default="")
    parser.add_argument("--growth", action="store_true")
    asked = parser.parse_args()
    (growth if asked.growth else compare)(asked)


if __name__ == "__main__":
    main()
