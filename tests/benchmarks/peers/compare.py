"""The strip footing by fabfem and by its peers, in turn, and how its cost grows: tables of docs/performance.md.

    python tests/benchmarks/peers/compare.py --dofs 5k 20k 81k --repeats 3 --felupe /tmp/peers/bin/python
    python tests/benchmarks/peers/compare.py --growth --repeats 3

Wall times are medians, processor times and memory the least. `--dolfinx` and `--felupe` name the interpreters that have
them (dolfinx: /usr/bin/python3 after `apt install python3-dolfinx libopenblas0-pthread`); what is not there is left
out.
`--growth` fits time and memory of 5k to 300k unknowns by a power, and prints the phases at 81k with one thread and two.
"""

import argparse
import json
import os
import statistics
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).parent
TWO = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "2")


def run(command: list[str], ours: bool = False) -> dict:
    """Return the last line of a program as a record; empty where it failed."""
    path = os.environ | TWO | {"PYTHONPATH": str(HERE.parents[2]) if ours else ""}
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
    """Return the commands of all programs."""
    dolfinx, felupe = str(HERE / "dolfinx_run.py"), str(HERE / "felupe_run.py")
    commands = [ours(dofs), ours(dofs, "--material", "ch"), ours(dofs, "--solver", "superlu")]
    if Path(asked.dolfinx).exists():
        commands += [[asked.dolfinx, dolfinx, dofs, kind] for kind in ("lu", "cholesky")]
    if asked.felupe and Path(asked.felupe).exists():
        commands.append([asked.felupe, felupe, dofs])
    return commands


def compare(asked: argparse.Namespace) -> None:
    """Print the table of all programs."""
    print("| program | dofs | wall s | processor s | of fabfem's | peak MB | solves | settlement m | load |")
    print("|" + "---|" * 9)
    for dofs in asked.dofs:
        commands = programs(asked, dofs)
        rows = [[run(command, ours=at < 3) for at, command in enumerate(commands)] for _ in range(asked.repeats)]
        least = min(row[0]["cpu_s"] for row in rows)
        for at, command in enumerate(commands):
            done = [row[at] for row in rows if row[at]]
            if not done:
                continue
            name = " ".join([done[0]["program"], done[0].get("material", ""), "superlu" * ("superlu" in command)])
            wall, processor = statistics.median(d["wall_s"] for d in done), min(d["cpu_s"] for d in done)
            cells = [name, done[0]["dofs"], f"{wall:.2f}", f"{processor:.2f}", f"{processor / least:.2f}"]
            cells += [f"{min(d['peak_mb'] for d in done):.0f}", done[0]["iterations"], f"{done[0]['settlement_m']:.7f}"]
            print("|", " | ".join(map(str, cells)), f"| {max(d['load_average'] for d in done):.0f} |", flush=True)


def growth(asked: argparse.Namespace) -> None:
    """Print time and memory by the number of unknowns, and the phases by the number of threads."""
    import numpy as np

    sizes = ("5k", "20k", "81k", "300k")
    rows = [[run(ours(dofs, "--clock", "processor"), ours=True) for dofs in sizes] for _ in range(asked.repeats)]
    dofs = [row["dofs"] for row in rows[0]]
    print("| dofs |", *(f"{n} |" for n in dofs), "power |\n|" + "---|" * 6)
    for what in ("wall_s", "cpu_s", "peak_mb"):
        values = [min(row[at][what] for row in rows) for at in range(len(sizes))]
        power = np.polyfit(np.log(dofs), np.log(values), 1)[0]
        print(f"| {what} |", *(f"{value:.2f} |" for value in values), f"{power:.2f} |")
    print("\n| phase, 81k | share of processor time | wall s, 1 thread | wall s, 2 threads | gain |\n|" + "---|" * 5)
    times = [[run(ours("81k", "--threads", n), ours=True) for n in ("1", "2")] for _ in range(asked.repeats)]
    shares = rows[0][2]["phases_s"]
    for phase in shares:
        one, two = (min(row[at]["phases_s"][phase] for row in times) for at in (0, 1))
        share = 100.0 * shares[phase] / sum(shares.values())
        print(f"| {phase} | {share:.0f} % | {one:.2f} | {two:.2f} | {one / two:.2f} |")
    print(f"\nload average {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")


def main() -> None:
    """Read the command line and run."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--dofs", nargs="+", default=["5k", "20k", "81k"])
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--dolfinx", default="/usr/bin/python3")
    parser.add_argument("--felupe", default="")
    parser.add_argument("--growth", action="store_true")
    asked = parser.parse_args()
    (growth if asked.growth else compare)(asked)


if __name__ == "__main__":
    main()
