"""Runs that are killed in the middle of an increment, and what is compared of results."""

import random
import signal
import subprocess
import sys
from pathlib import Path
from time import monotonic, sleep

ROOT = Path(__file__).parents[3]
COMMAND = [sys.executable, "-m", "fabfem", "solve", "--quiet"]


def solve(case: Path, folder: Path, *more: str) -> subprocess.Popen[bytes]:
    """Start a run in a process of its own."""
    return subprocess.Popen([*COMMAND, str(case), "--out", str(folder), *more], cwd=ROOT)


def rows(folder: Path) -> int:
    """Return the number of rows that a history has so far."""
    file = folder / "history.csv"
    return file.read_bytes().count(b"\n") - 1 if file.is_file() else 0


def killed(case: Path, folder: Path, at: int, chance: random.Random, *more: str) -> bool:
    """Start a run, kill it (SIGKILL) within a tenth of a second of its row `at`; return whether it still ran."""
    run = solve(case, folder, *more)
    end = monotonic() + 300.0
    while run.poll() is None and rows(folder) < at and monotonic() < end:
        sleep(0.002)
    sleep(chance.uniform(0.0, 0.1))
    run.send_signal(signal.SIGKILL)
    return run.wait() == -signal.SIGKILL


def content(folder: Path) -> dict[str, bytes]:
    """Return the tables and fields of a result by file."""
    patterns = ("*.csv", "*.vtu", "*.pvd")
    return {file.name: file.read_bytes() for pattern in patterns for file in sorted(folder.glob(pattern))}
