"""The problems that `fabfem verify` runs, by name. A new one is a module with `rows()` and a line here."""

from collections.abc import Iterator, Sequence
from importlib import import_module
from typing import NamedTuple

from fabfem.case import CaseError, suggest
from fabfem.verification.row import Row


class Problem(NamedTuple):
    """A problem with known answers."""

    title: str
    """What it is, in a line."""
    module: str
    """Module beside this one whose `rows()` yields its rows."""


PROBLEMS = {
    "convergence": Problem("Manufactured solutions: order of convergence of every element", "convergence"),
    "cylinder": Problem("Thick elastic cylinders: Lamé's, and nearly incompressible", "cylinder"),
    "cook": Problem("Cook's membrane", "cook"),
    "hill_tube": Problem("Hill's tube: thick Tresca cylinder, b/a = 2", "hill_tube"),
    "mohr_coulomb_hole": Problem("Hole in Mohr-Coulomb ground", "mohr_coulomb_hole"),
    "circular_footing": Problem("Circular footings on Tresca ground", "circular_footing"),
    "consolidation": Problem("Consolidation: Terzaghi's layer, Mandel's slab, Cryer's sphere", "consolidation"),
    "undrained_tube": Problem("Thick tube with water that cannot flow", "undrained_tube"),
    "slopes": Problem("Slopes: factors of safety against upper bounds, associated", "slopes"),
    "chang_hicher": Problem("Chang-Hicher stress point against an independent prototype", "chang_hicher"),
    "critical_state": Problem("One critical state, whatever the direction of shear", "critical_state"),
    "bearing_capacity": Problem("Strip footings on associated Mohr-Coulomb ground", "bearing_capacity"),
}
"""Name -> problem, in the order in which they run."""


def chosen(names: Sequence[str] = ()) -> dict[str, Problem]:
    """Return the problems of some names, or all.

    Raises
    ------
    CaseError
        If there is no problem of a name.
    """
    for name in names:
        if name not in PROBLEMS:
            raise CaseError(f"--only: there is no problem '{name}'{suggest(name, PROBLEMS)}")
    return {name: problem for name, problem in PROBLEMS.items() if not names or name in names}


def rows(problem: Problem) -> Iterator[Row]:
    """Yield the rows of a problem as they are computed."""
    yield from import_module(f"fabfem.verification.{problem.module}").rows()
