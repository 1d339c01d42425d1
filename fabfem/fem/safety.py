"""The factor of safety: the factor F by which the strength can be divided before the body fails.

The loads stay, F rises in steps from the stage's first value, each equilibrium starting from the last; where one is
missing, the bracket [last equilibrium, first failure] is halved until it is narrower than the tolerance. That Newton's
method does not converge is no failure: the body is then let flow (`fabfem.fem.flow`), and the factor counts as failed
only if it flows on; where it comes to rest, the search goes on from there.

What `umat.weakened` divides: c and tan φ of Mohr–Coulomb (ψ no larger than φ), M and k0 of Drucker–Prager, σ_y of von
Mises, tan φ_μ of Chang–Hicher, hence its tan φ_p = (e_c/e) tan φ_μ and tan φ_d = (e/e_c) tan φ_μ alike.
"""

from collections.abc import Generator, Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from fabfem.fem.flow import EQUILIBRIUM, Flow, elastic_displacement, flow
from fabfem.fem.increment import Collapsed, Cutback, Factor, Increment, Place, Step, advanced, increment
from fabfem.fem.loads import Loading
from fabfem.fem.model import weaken
from fabfem.fem.newton import Solved, solve_increment
from fabfem.fem.points import Refusal
from fabfem.fem.stages import StrengthSearch
from fabfem.fem.trial import Equilibrium, System, Trial

SPARED = Solved(Refusal("Newton's method was not tried, as it had failed with the last factor that stands"), 0, ())


class Bracket(NamedTuple):
    """The last factor with equilibrium and the first without, where there is one yet."""

    low: float | None
    high: float | None
    sure: bool
    """Whether the first failure was tried from the last equilibrium itself."""

    def closed(self, goal: StrengthSearch) -> bool:
        """Whether there is nothing left to search."""
        if self.high is None:
            return self.low is not None and self.low >= goal.largest
        return self.low is None or (self.narrow(goal) and self.sure)

    def narrow(self, goal: StrengthSearch) -> bool:
        """Whether it is as narrow as the goal asks."""
        return self.low is not None and self.high is not None and self.high - self.low <= 1.0001 * goal.tolerance

    def target(self, goal: StrengthSearch, first: float) -> float:
        """The factor to try next."""
        if self.low is None:
            return first
        if self.high is None:
            return min(round(self.low + goal.step, 10), goal.largest)
        return self.high if self.narrow(goal) else round(0.5 * (self.low + self.high), 10)

    def after(self, factor: float, stands: bool) -> "Bracket":
        """The bracket once a factor was tried; one that stands after all opens it again."""
        if not stands:
            return Bracket(self.low, factor, True)
        return Bracket(factor, self.high if self.high is not None and self.high > factor else None, False)


class Search(NamedTuple):
    """What a search has come to."""

    bracket: Bracket
    start: np.ndarray
    """(ndof,) displacement where it began."""
    enough: float
    """Displacement beyond which a steady flow is a failure [length]."""
    tried: tuple[Factor, ...] = ()
    flowed: bool = False
    """Whether the last equilibrium was reached by a flow; the next factor then begins with one."""


class Try(NamedTuple):
    """What came of a factor."""

    factor: float
    system: System
    answer: Solved
    fluent: Flow | None
    """The flow, where Newton's method found no equilibrium."""

    @property
    def verdict(self) -> str:
        """``equilibrium``, ``collapse`` or ``undecided``."""
        return self.fluent.verdict if self.fluent else EQUILIBRIUM

    @property
    def trial(self) -> Trial | None:
        """The last increment: that which ends in equilibrium, or the last of a flow."""
        return self.fluent.trial if self.fluent else self.answer.end if isinstance(self.answer.end, Trial) else None


def through(
    place: Place, system: System, now: Equilibrium, load: Loading
) -> Generator[Increment | Collapsed, None, tuple[None, int]]:
    """Yield the equilibria found on the way to the factor of safety, then how the search ended."""
    goal, number = place.stage.goal, place.number
    assert isinstance(goal, StrengthSearch)
    bracket, start, enough, tried, flowed = place.progress or _search(system, goal, now, load)
    cutbacks: tuple[Cutback, ...] = ()
    failed: Try | None = None  # after an equilibrium a search ends with another failure, or with none
    spent = dict(system.timer.spent)
    while not bracket.closed(goal):
        factor = bracket.target(goal, place.stage.strength)
        new = _attempted(place, system, now, load, factor, enough, flowed)
        stands = new.verdict == EQUILIBRIUM
        bracket = bracket.after(factor, stands)
        tried += (_entry(new, system, start, now),)
        if stands:
            number += 1
            flowed = new.fluent is not None
            search = Search(bracket, start, enough, tried, flowed)
            there = place._replace(number=number, progress=search)
            reached = _recorded(there, new, now, load, cutbacks, system.timer.since(spent))
            now, cutbacks, spent = _rest(new, now), (), dict(system.timer.spent)
            yield reached
        else:
            failed = new
            cutbacks += (_cutback(place, new),)
    flowing = None
    if failed and failed.trial and bracket.high is not None:
        there = place._replace(number=number + 1, progress=None)
        flowing = _recorded(there, failed, now, load, (), {})
    verdict, reason = _verdict(bracket, failed)
    timings = system.timer.since(spent)
    yield Collapsed(
        *(place.stage.name, place.stage_index, bracket.low, bracket.high, verdict, reason, tried, flowing, cutbacks),
        timings=timings,
    )
    return None, number


def _search(system: System, goal: StrengthSearch, now: Equilibrium, load: Loading) -> Search:
    """A search that begins."""
    enough = goal.displacement or goal.growth * elastic_displacement(system, now, load.total(1.0))
    return Search(Bracket(None, None, False), now.displacement, enough)


def _attempted(
    place: Place, system: System, now: Equilibrium, load: Loading, factor: float, enough: float, flowed: bool
) -> Try:
    """What comes of a factor after the equilibrium `now`; Newton's method is not tried where that came of a flow."""
    weak = system._replace(zones=weaken(system.zones, factor, place.stage.spared))
    forces = load.total(1.0)
    answer = SPARED if flowed else solve_increment(weak, now, forces, 1.0)
    fluent = flow(weak, now, forces, enough) if isinstance(answer.end, Refusal) else None
    return Try(factor, weak, answer, fluent)


def _rest(new: Try, now: Equilibrium) -> Equilibrium:
    """The equilibrium that a factor which stands leads to."""
    if new.fluent:
        return new.fluent.now
    assert isinstance(new.answer.end, Trial)
    return advanced(now, new.answer.end)


def _entry(new: Try, system: System, start: np.ndarray, now: Equilibrium) -> Factor:
    end = _rest(new, now)
    drag = new.fluent.drag if new.fluent and new.verdict != EQUILIBRIUM else 0.0
    return Factor(new.factor, new.verdict, system.space.farthest(end.displacement - start), drag)


def _recorded(
    place: Place, new: Try, now: Equilibrium, load: Loading, cutbacks: tuple[Cutback, ...], timings: Mapping[str, float]
) -> Increment:
    """The record of the increment that a factor ended with, after which the search has come to `place`.

    A flow counts as one increment.
    """
    goal, trial, end = place.stage.goal, new.trial, _rest(new, now)
    assert isinstance(goal, StrengthSearch)
    assert trial is not None
    fraction = min((new.factor - place.stage.strength) / (goal.largest - place.stage.strength), 1.0)
    answer = Solved(trial, new.fluent.iterations, new.fluent.residuals) if new.fluent else new.answer
    step = Step(answer, fraction, goal.step, load.total(1.0), load.on_soil(1.0), cutbacks)
    begun = new.fluent.old if new.fluent and new.verdict != EQUILIBRIUM else now
    whole = trial._replace(step=end.displacement - begun.displacement)
    found = increment(place, new.system, begun, end, step, whole, dict(timings))
    return replace(found, strength=new.factor, load_factor=1.0)


def _cutback(place: Place, new: Try) -> Cutback:
    refusal = new.answer.end
    assert isinstance(refusal, Refusal)
    reason = f"strength divided by {new.factor:g}: {refusal.reason}"
    return Cutback(place.stage.name, 0.0, 0.0, reason, refusal.point, refusal.refused, new.answer.residuals)


def _verdict(bracket: Bracket, failed: Try | None) -> tuple[str, str]:
    if bracket.high is None or failed is None or failed.fluent is None:
        return "none", f"no factor up to {bracket.low:g} failed"
    where = "the first factor, " if bracket.low is None else ""
    return failed.verdict, f"with {where}{bracket.high:g}: {failed.fluent.reason}"
