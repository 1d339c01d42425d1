"""The phases of the strip footing at two commits, as ratios.

    python tests/benchmarks/regression.py OLD [NEW] [--dofs 20k] [--material von_mises] [--repeats 3] [--limit 1.15]

Both commits are unpacked into a temporary folder and run by this checkout's `footing.py`, in turn, on one thread. What
is compared is processor time, the least of the repetitions, which other programs on the machine change little. The exit
status is 1 where the new whole takes more than `limit` times the old one.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).parent


def unpack(commit: str, folder: Path) -> Path:
    """Put the files of a commit into a folder."""
    folder.mkdir()
    packed = subprocess.run(["git", "archive", commit], cwd=HERE.parents[1], capture_output=True, check=True)
    subprocess.run(["tar", "-x", "-C", str(folder)], input=packed.stdout, check=True)
    return folder


def phases(source: Path, asked: argparse.Namespace) -> dict[str, float]:
    """Return the processor time of each phase of one run of the code in a folder [s], and the number of solves."""
    command = [sys.executable, str(HERE / "footing.py"), "--dofs", asked.dofs, "--material", asked.material]
    command += ["--threads", "1", "--clock", "processor", "--solver", asked.solver]
    ran = subprocess.run(command, env=os.environ | {"PYTHONPATH": str(source)}, capture_output=True, text=True)
    if ran.returncode:
        raise SystemExit(ran.stderr)
    row = json.loads(ran.stdout.splitlines()[-1])
    return row["phases_s"] | {"whole": row["cpu_s"], "linear solves": row["iterations"]}


def main() -> int:
    """Read the command line, run, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("old")
    parser.add_argument("new", nargs="?", default="HEAD")
    parser.add_argument("--dofs", default="20k")
    parser.add_argument("--material", default="von_mises")
    parser.add_argument("--solver", default="auto")
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--limit", type=float, default=1.15)
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        sources = [unpack(at, Path(folder) / name) for name, at in (("old", asked.old), ("new", asked.new))]
        runs = [[phases(source, asked) for source in sources] for _ in range(asked.repeats)]
    old, new = ({name: min(run[at][name] for run in runs) for name in runs[0][at]} for at in (0, 1))
    print(f"| {asked.material}, {asked.dofs} | {asked.old} | {asked.new} | ratio |\n|---|---|---|---|")
    for name in new:
        ratio = new[name] / old[name] if old.get(name) else float("nan")
        print(f"| {name} | {old.get(name, 0.0):.3f} | {new[name]:.3f} | {ratio:.2f} |")
    return int(new["whole"] > asked.limit * old["whole"])


if __name__ == "__main__":
    sys.exit(main())
