"""What starting takes: ``python tests/benchmarks/start_up.py [--repeats N]`` writes the table of docs/performance.md.

Wall time of commands as a user gives them, each in a process of its own, after one that fills the caches; one after
another, so that a slow minute of the machine touches all. The first two rows are what the packages alone take. The
column *cold* is one more run of each, after the system was told to drop what it keeps of the files of interpreter,
packages, program and caches (Linux); what other processes have mapped stays.
"""

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from page import write_table

HOME = Path(__file__).parents[2]
ELEMENT, CIRCULAR, STRIP = "element/drained_triaxial", "footing/circular_toyoura", "footing/strip_toyoura"
PACKAGES = ["-c", "import numba, skfem, pydantic, meshio"]
COMMANDS: dict[str, tuple[list[str], str]] = {
    "`python -c 'import numpy'`": (["-c", "import numpy"], ""),
    "`python -c 'import numba, skfem, pydantic, meshio'`": (PACKAGES, ""),
    **{
        f"`fabfem check cases/{name}.toml`": (["-m", "fabfem", "check", name], "1")
        for name in (ELEMENT, CIRCULAR, STRIP)
    },
    f"`fabfem solve cases/{ELEMENT}.toml`": (["-m", "fabfem", "solve", ELEMENT, "--out", "DIR"], "2"),
}


def seconds(words: list[str], folder: str) -> float:
    """Return the wall time of a command [s]."""
    known = {name: str(HOME / "cases" / f"{name}.toml") for name in (ELEMENT, CIRCULAR, STRIP)} | {"DIR": folder}
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONDONTWRITEBYTECODE"}
    begin = time.perf_counter()
    said = [sys.executable, *(known.get(word, word) for word in words)]
    subprocess.run(said, env=environment, cwd=HOME, stdout=subprocess.DEVNULL, check=True)
    return time.perf_counter() - begin


def dropped() -> int:
    """Let the system drop the pages of all files that a start may read; return how many files."""
    sys.path.insert(0, str(HOME))
    from umat.cache import user_cache

    count = 0
    for folder in {
        Path(sys.prefix),
        Path(sys.base_prefix),
        HOME / "fabfem",
        HOME / "umat",
        HOME / "cases",
        user_cache(),
    }:
        for path in folder.rglob("*"):
            if path.is_file():
                with path.open("rb") as file:
                    os.posix_fadvise(file.fileno(), 0, 0, os.POSIX_FADV_DONTNEED)
                count += 1
    return count


def cold(words: list[str], folder: str) -> str:
    """Return the wall time of a command whose files are not in memory [s]."""
    if not hasattr(os, "posix_fadvise"):
        return "–"
    dropped()
    return f"{seconds(words, folder):.2f}"


def main() -> None:
    """Measure, print and write the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=9)
    repeats = parser.parse_args().repeats
    with tempfile.TemporaryDirectory() as folder:
        rounds = [[seconds(words, folder) for words, _ in COMMANDS.values()] for _ in range(1 + repeats)][1:]
        once = [cold(words, folder) for words, _ in COMMANDS.values()]
    lines = ["| | least | median | cold | wanted |", "|---|---|---|---|---|"]
    for (name, (_, wanted)), times, first in zip(COMMANDS.items(), zip(*rounds, strict=True), once, strict=True):
        lines.append(f"| {name} | {min(times):.2f} | {statistics.median(times):.2f} | {first} | {wanted} |")
    print("\n".join(lines))
    write_table("performance.md", "start-up", lines)


if __name__ == "__main__":
    main()
