"""Convergence of the gallery's curves: the case, or the runs at both ends of its sweep, against runs ten times finer.

    python tests/benchmarks/gallery_convergence.py cases/element/*.toml cases/fabric/{yuan_*,all_laws}.toml

prints, for each case and column, the largest distance of a curve from its fine one, at equal strain, over the largest
value of the fine one. The fine runs have a tenth of ``accuracy.curve``; laws of fabric, which follow the records of
their loading, have four times as many of these.
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
MORE = 4
COLUMNS = ("p", "q", "eps_v", "F_norm", "eta", "F_q")


def main(files: list[Path]) -> None:
    """Print the distances of all cases."""
    with tempfile.TemporaryDirectory() as folder, Pool(limits()) as pool:
        for file in files:
            known = distances if read_case(file).scene.kind == "element" else of_laws
            found = known(file, Path(folder), pool)
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


def of_laws(file: Path, folder: Path, pool: Pool) -> dict[str, float]:
    """Return the largest relative distance of each column, over all laws and paths of a case."""
    legs = read_case(file).loading.leg
    finer = tuple(
        Setting("records", (f"loading.leg[{k}].records",), MORE * leg.records) for k, leg in enumerate(legs, 1)
    )
    both = {run.choice: run.history() for run in runs(Plan(read_tables(file), file, folder, [(), finer]), pool)}
    coarse, fine = both[()], both[finer]
    curves = dict.fromkeys(zip(coarse["law"], coarse["path"], strict=True))
    return {
        name: max(distance(_curve(coarse, key, name, MORE), _curve(fine, key, name, 1)) for key in curves)
        for name in ("eta", "F_q")
    }


def _curve(run: dict[str, list[str]], key: tuple[str, str], name: str, stride: int) -> tuple[list[float], list[str]]:
    """Return a curve of a law along a path, by the records of the fine run, where the coarse one has records too."""
    rows = enumerate(zip(run["law"], run["path"], run["record"], strict=True))
    mine = [row for row, (*found, record) in rows if tuple(found) == key and stride * int(record) % MORE == 0]
    return [stride * float(run["record"][row]) for row in mine], [run[name][row] or "nan" for row in mine]


def _places(run: dict[str, list[str]]) -> list[float]:
    """Return where the rows of a history are: twice the number of their stage, and the share of its target."""
    stages = list(dict.fromkeys(run["stage"]))
    return [2.0 * stages.index(stage) + float(part) for stage, part in zip(run["stage"], run["fraction"], strict=True)]


def distance(coarse: tuple[list[float], list[str]], fine: tuple[list[float], list[str]]) -> float:
    """Return the largest distance of two curves, each (place, values), over the largest value of the second."""
    (across, values), (places, truth) = (np.array(curve, dtype=float) for curve in (coarse, fine))
    reached = places <= across[-1]
    top = np.nanmax(np.abs(truth))
    gap = np.nanmax(np.abs(np.interp(places[reached], across, values) - truth[reached]))
    return float(gap / top) if top > 1e-9 else 0.0


if __name__ == "__main__":
    main([Path(argument) for argument in sys.argv[1:]])
