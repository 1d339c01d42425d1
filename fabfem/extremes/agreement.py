"""Whether an answer depends on what it must not: the linear solver, the number of threads, the run."""

from collections.abc import Iterator
from importlib.util import find_spec

import numpy as np

from fabfem.extremes.strength import on_sand
from fabfem.extremes.sweep import Extreme, Found, sweep
from fabfem.verification.bearing_capacity import soil
from fabfem.verification.ground import Ground, footing
from fabfem.verification.scene import Answer, Tables, solve
from umat.threads import get_threads, set_threads


def extremes() -> Iterator[Extreme]:
    """Yield the comparisons."""
    if find_spec("pypardiso") is not None:
        what = "SuperLU against PARDISO: displacement"
        yield sweep(f"{what}, footing, φ = 30°", "size of the cells [B]", (0.2, 0.1, 0.05), solvers, 1e-8, 0.05)
        yield sweep(f"{what}, footing on Toyoura sand", "surcharge [kPa]", (10.0, 1.0), sand_solvers, 1e-8, 1.0)
    yield sweep("1 thread against more: displacement, Toyoura sand", "threads", (2, 3), threads, 0.0, 3)
    yield sweep("the same run again: displacement, Toyoura sand", "runs", (2, 3), again, 0.0, 3)


def solvers(fine: float) -> Found:
    """Return the distance of the displacements that two linear solvers give, over their size, from zero."""
    tables = footing(soil(30, cohesion=1.0), 0.02, True)
    mesh = Ground(3.0, 1.5, fine, 1.3).mesh("quad")
    return _apart(*(solve(tables | {"solver": _with(name)}, mesh) for name in ("superlu", "pardiso")))


def sand_solvers(surcharge: float) -> Found:
    """Return the same for a footing on sand."""
    return _apart(*(on_sand(surcharge, 0.1, _with(name)) for name in ("superlu", "pardiso")))


def threads(count: float) -> Found:
    """Return the same for one thread and `count`."""
    before = get_threads()
    try:
        return _apart(*(on_sand(1.0, 0.1, {"threads": number}) for number in (1, int(count))))
    finally:
        set_threads(before)


def again(runs: float) -> Found:
    """Return the same for a run and its repetition."""
    return _apart(*(on_sand(1.0, 0.1, {}) for _ in range(int(runs))))


def _with(name: str) -> Tables:
    return {"linear": name, "tolerance": 1e-11}


def _apart(*answers: Answer) -> Found:
    """The largest distance of displacements from those of the first answer."""
    stopped = next((answer.stopped for answer in answers if answer.stopped), "")
    ends = [answer.last.displacement for answer in answers if answer.last is not None]
    if stopped or len(ends) < len(answers):
        return Found(None, 0.0, stopped or "no increment converged")
    size = float(np.abs(ends[0]).max())
    return Found(max(float(np.abs(end - ends[0]).max()) for end in ends[1:]) / size, 0.0)
