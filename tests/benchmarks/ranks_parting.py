"""Where and why runs of a sand part that differ by round-off: numbers of docs/parallel.md.

``python tests/benchmarks/ranks_parting.py [CASE]`` marches a scene with PARDISO and with SuperLU side by side, and
prints now and then how far stresses and tangents of the points are apart. At the first increment where the stresses
jump apart, the trial and the point where they do is found; strain and state of that point are led from what one run has
to what the other has, and beyond, in small steps, and the largest step of the stress is printed for several tolerances
of the point's sub-steps.

First it is printed what the geostatic increment does, which moves by round-off alone: how far the tangents of the next
trial come apart when that round-off is another.
"""

import sys
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import umat
from fabfem.boundary_value.problem import build
from fabfem.case import case_from, read_tables
from fabfem.fem import trial
from fabfem.fem.model import Model
from fabfem.fem.solve import march
from fabfem.study.variants import with_value

CASE = Path(__file__).parents[2] / "cases" / "footing" / "strip_toyoura_gmsh.toml"
JUMP = 1e-5
"""Difference of stresses, over the largest, that was not there an increment before."""
TOLERANCES = 1e-3, 1e-4, 1e-5, 1e-6


class Tried(NamedTuple):
    """A trial of a run: the strains (npoints, 6), the states before it, and the answer."""

    strain: np.ndarray
    states: Any
    batch: Any


class Run:
    """A march that keeps the trials of its last increment."""

    def __init__(self, case: Path, solver: str) -> None:
        tables = with_value(read_tables(case), "solver.linear", solver)
        self.model: Model = build(case_from(tables, case)).model
        self.tried: list[Tried] = []
        self._steps = march(self.model)

    def step(self) -> Any:
        """Return the next increment."""
        self.tried.clear()
        watched, kept = self.tried, trial.update_points

        def watch(zones: Any, strain: np.ndarray, old: Any, may_hold: float = 0.0) -> Any:
            batch = kept(zones, strain, old, may_hold)
            watched.append(Tried(strain, *old.values(), batch))
            return batch

        trial.update_points = watch
        try:
            return next(self._steps)
        finally:
            trial.update_points = kept


def apart(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return the largest difference at each point over the largest value of all."""
    axes = tuple(range(1, one.ndim))
    return np.abs(one - other).max(axis=axes) / np.abs(one).max()


def on_the_way(one: Any, other: Any, way: np.ndarray) -> Any:
    """Return states (n, ...) of a point on the way from one state (0) to another (1)."""
    parts = zip(one, other, strict=True)
    return type(one)(*(a + way.reshape((-1,) + (1,) * (a.ndim - 1)) * (b - a) for a, b in parts))


def verge(run: Run) -> None:
    """Print what another round-off in the first increment does to the trial after it."""
    run.step()
    first = run.tried[0]
    run.step()
    second, (zone,) = run.tried[0], run.model.zones.values()

    def after(strain: np.ndarray) -> tuple[Any, Any]:
        begun = umat.update(zone.material, zone.directions, strain, first.states)
        return begun, umat.update(zone.material, zone.directions, second.strain, begun.state)

    rng = np.random.default_rng(1)
    whole = after(first.strain)
    print(f"largest strain of the first increment {np.abs(first.strain).max():.0e}; with another round-off:")
    for size in (1e-20, 1e-18, 1e-16):
        other = after(first.strain + size * rng.normal(size=first.strain.shape))
        tangents = [apart(a.tangent, b.tangent).max() for a, b in zip(whole, other, strict=True)]
        print(
            f"  {size:.0e}: tangents {tangents[0]:.0e} apart, those of the next trial {tangents[1]:.0e},"
            f" its stresses {apart(whole[1].stress, other[1].stress).max():.0e}"
        )


def parted(one: Run, other: Run) -> tuple[Tried, Tried, int]:
    """March until the stresses jump apart; return the first trials that do, and the point."""
    before = 0.0
    while True:
        a, b = one.step(), other.step()
        (x,), (y,) = a.states.values(), b.states.values()
        stresses, tangents = apart(x.stress, y.stress).max(), apart(a.tangent, b.tangent).max()
        jumped = stresses > JUMP and stresses > 100.0 * before
        if a.number % 5 == 0 or jumped:
            print(
                f"{a.number}: {a.iterations}, {b.iterations} iterations to {a.residuals[-1]:.8e}, "
                f"{b.residuals[-1]:.8e}; stresses {stresses:.0e}, tangents {tangents:.0e} apart",
                flush=True,
            )
        before = stresses
        if jumped:
            for left, right in zip(one.tried, other.tried, strict=False):
                gaps, strain = apart(left.batch.stress, right.batch.stress), apart(left.strain, right.strain)
                if gaps.max() > JUMP:
                    print(f"point {gaps.argmax()}: strains {strain.max():.0e}, stress {gaps.max():.0e} apart")
                    return left, right, int(gaps.argmax())


def main(case: Path) -> None:
    """Print all of it."""
    verge(Run(case, "pardiso"))
    one = Run(case, "pardiso")
    left, right, point = parted(one, Run(case, "superlu"))
    (zone,) = one.model.zones.values()
    way = np.linspace(-3000.0, 3000.0, 3001)[:, None]
    strains = [part.strain[[point]] for part in (left, right)]
    states = [type(part.states)(*(array[[point]] for array in part.states)) for part in (left, right)]
    strain, state = strains[0] + way * (strains[1] - strains[0]), on_the_way(*states, way[:, 0])
    size, step = np.linalg.norm(strains[0]), np.linalg.norm(strain[1] - strain[0])
    print(f"strains of {size:.1e}, {step:.0e} from step to step")
    for tolerance in TOLERANCES:
        material = zone.material._replace(tolerance=tolerance, max_evaluations=1e5)
        found = umat.update(material, zone.directions, strain, state)
        steps = np.abs(np.diff(found.stress, axis=0)).max(axis=1) / np.abs(found.stress).max()
        print(
            f"tolerance {tolerance:.0e}: steps of the stress {np.median(steps):.0e}, at most {steps.max():.0e}"
            f" ({(steps > 100.0 * np.median(steps)).sum()} jumps), {np.median(found.work):.0f} evaluations"
        )


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else CASE)
