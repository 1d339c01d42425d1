"""What ``[solver] diagnose = true`` records of the stiffness at the end of every increment, a column each.

Both are those of `fabfem.fem.diagnosis`; each increment pays for one more factorisation. Several ranks have the
condition alone: MUMPS solves with its factors, and with their transposes, but does not tell their entries.
"""

from typing import Any

import numpy as np

from fabfem.boundary_value.probes import Column
from fabfem.fem.diagnosis import Condition, condition
from fabfem.fem.increment import Increment
from fabfem.fem.linear import whole
from fabfem.fem.model import Model
from fabfem.fem.systems import systems_of


class Conditioning:
    """The condition of the stiffness of the last increment that was asked for."""

    def __init__(self, model: Model) -> None:
        self._systems = systems_of(model)
        self._last: tuple[int, Condition] | None = None

    def of(self, increment: Increment) -> Condition:
        """Return condition number and pivot growth of the tangent at the end of an increment."""
        if self._last is None or self._last[0] != increment.number:
            self._last = (increment.number, self._found(increment))
        return self._last[1]

    def _found(self, increment: Increment) -> Condition:
        system = self._systems[increment.stage_index]
        wet = None if system.water is None else system.water.matrix(increment.size)
        matrix = system.reduction.stiffness(increment.tangent, wet)
        if system.space.mesh.ranks.size > 1:
            solver: Any = system.solver  # several ranks have PETSc's
            return Condition(solver.condition(matrix), np.nan)
        return condition(whole(matrix, system.solver.triangle))


def conditioning_columns(model: Model) -> tuple[Column, ...]:
    """Return the columns ``condition_number`` and, of one rank, ``pivot_growth``."""
    found = Conditioning(model)
    number = Column("condition_number", "-", "", lambda increment: found.of(increment).number)
    growth = Column("pivot_growth", "-", "", lambda increment: found.of(increment).growth)
    return (number,) if model.space.mesh.ranks.size > 1 else (number, growth)
