"""Convergence of the gallery's curves: the case, or the runs at both ends of its sweep, against runs ten times finer.

    python tests/benchmarks/gallery_convergence.py cases/element/*.toml

prints, for each case and column, the largest distance of a curve from its fine one, at equal strain, over the largest
value of the fine one. The fine runs have a tenth of ``accuracy.curve``.
"""

import sys
import tempfile
from pathlib import Path

import numpy as np

from fabfem.case import read_case, read_tables
from fabfem.study.processes import Pool, limits
from fabfem.study.store import Plan, Run, runs
from fabfem.study.variants import Choice, Setting, choices

FINER = 10.0
COLUMNS = ("p", "q", "eps_v", "F_norm")


def main(files: list[Path]) -> None:
    """Print the distances of all cases."""
    with tempfile.TemporaryDirectory() as folder, Pool(limits()) as pool:
        for file in files:
            found = distances(file, Path(folder), pool)
            said = "  ".join(f"{name} {100.0 * found[name]:.3f} %" for name in COLUMNS if name in found)
            print(f"{file.stem:24s} {said}", flush=True)


def distances(file: Path, folder: Path, pool: Pool) -> dict[str, float]:
    """Return the largest relative distance of each column, over the first and last run of its sweep, or its own."""
    case = read_case(file)
    every = choices(case.sweep.parameter) if case.sweep else [()]
    ends = list(dict.fromkeys([every[0], every[-1]]))
    finer = Setting("accuracy", ("accuracy.curve",), case.accuracy.curve / FINER)
    pairs: dict[Choice, Run] = {
        run.choice: run
        for run in runs(Plan(read_tables(file), file, folder, [*ends, *((*c, finer) for c in ends)]), pool)
    }
    found: dict[str, float] = {}
    for choice in ends:
        coarse, fine = pairs[choice].history(), pairs[(*choice, finer)].history()
        for name in COLUMNS:
            if name in fine and coarse:
                here = distance(*((_places(run), run[name]) for run in (coarse, fine)))
                found[name] = max(found.get(name, 0.0), here)
    return found


def _places(run: dict[str, list[str]]) -> list[float]:
    """Return where the rows of a history are: twice the number of their stage, and the share of its target."""
    stages = list(dict.fromkeys(run["stage"]))
    return [2.0 * stages.index(stage) + float(part) for stage, part in zip(run["stage"], run["fraction"], strict=True)]


def distance(coarse: tuple[list[float], list[str]], fine: tuple[list[float], list[str]]) -> float:
    """Return the largest distance of two curves, each (place, values), over the largest value of the second."""
    (across, values), (places, truth) = (np.array(curve, dtype=float) for curve in (coarse, fine))
    reached = places <= across[-1]
    top = np.abs(truth).max()
    gap = np.abs(np.interp(places[reached], across, values) - truth[reached]).max()
    return float(gap / top) if top > 1e-9 else 0.0


if __name__ == "__main__":
    main([Path(argument) for argument in sys.argv[1:]])
