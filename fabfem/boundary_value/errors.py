"""How wrong a run is, by its own estimate: what ``[errors]`` asks for, a column of the history each.

* ``equilibrium``: the force that the last iteration left out of balance, with the drag of the viscosity, over the
  forces at work.
* ``integration``: the error of the stress that the points estimate for their own steps, over the stress, both root mean
  square over the volume, added up over the increments. Materials in closed form have none. It is the error of the
  lower of two orders and keeps its sign to itself, so that the truth is far below (docs/study.md).
* ``substeps``: the same error, from some points of each zone, spread evenly over its volume, that go through the same
  strains with a hundredth of the tolerance; the distance of the two stresses over the first, both root mean square.
* ``discretisation``: of the mesh, in the energy norm, from the recovered stress (`fabfem.fem.recovery`), over the norm
  of the stress. The field ``discretisation_error`` says where: the root of the error's energy density over the mean
  energy density.
* ``directions``: of the set of contact directions, by a second rule instead of a smaller tolerance.
"""

from collections.abc import Callable, Mapping

import numpy as np

from fabfem.boundary_value.discretisation import Discretisation
from fabfem.boundary_value.followed import Followed, finer
from fabfem.boundary_value.probes import Column, Keeper, Value
from fabfem.case import BoundaryValueCase, CaseError
from fabfem.fem.model import Model
from fabfem.fem.points import stress_of
from fabfem.fem.solve import Increment
from fabfem.substance import Substance
from umat.mandel import norm


class Integration:
    """The error of the points' integration, added up."""

    def __init__(self, model: Model) -> None:
        self.model, self.weights = model, model.space.weights
        self.total = 0.0

    def value(self, increment: Increment) -> float:
        """Return the sum over all increments so far."""
        size = norm(stress_of(self.model.space, self.model.zones, increment.states))
        total = self.model.space.mesh.ranks.sum
        whole = np.sqrt(total(float(self.weights @ size**2)))
        error = np.sqrt(total(float(self.weights @ (increment.local_error * size) ** 2)))
        self.total += float(error / whole) if whole else 0.0
        return self.total

    def memory(self) -> float:
        """Return the sum so far."""
        return self.total

    def recall(self, memory: float) -> None:
        """Go on from a sum."""
        self.total = memory


def error_columns(
    case: BoundaryValueCase, model: Model, second: Callable[[str | None], Mapping[str, Substance]]
) -> tuple[tuple[Column, ...], Discretisation | None]:
    """Return the columns of the errors that a case asks for, and the estimate of the mesh's if it is among them.

    Parameters
    ----------
    case : BoundaryValueCase
        What is asked.
    model : Model
        What is run.
    second : callable
        Name of a rule -> substances by zone with that rule, with their own for None, where there are directions.

    Raises
    ------
    CaseError
        If no material has contact directions whose error could be estimated.
    """
    said = case.errors
    if said is None:
        return (), None
    mesh = Discretisation(model)
    makers: dict[str, Callable[[], tuple[Callable[[Increment], Value], Keeper | None]]] = {
        "equilibrium": lambda: (lambda increment: increment.residuals[-1] + increment.drag, None),
        "integration": lambda: _kept(Integration(model)),
        "discretisation": lambda: (mesh.value, None),
        "directions": lambda: _kept(Followed(model, _seconds(case, second(said.rule)), said.samples)),
        "substeps": lambda: _kept(Followed(model, finer(_seconds(case, second(None))), said.samples)),
    }
    columns = tuple(Column(f"error_{name}", "-", "error", *makers[name]()) for name in said.estimate)
    return columns, mesh if "discretisation" in said.estimate else None


def _kept(error: Integration | Followed) -> tuple[Callable[[Increment], Value], Keeper]:
    return error.value, error


def _seconds(case: BoundaryValueCase, found: Mapping[str, Substance]) -> Mapping[str, Substance]:
    if not found:
        raise CaseError(f"{case.path.name}: errors.estimate: no material here has contact directions")
    return found
