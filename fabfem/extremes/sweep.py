"""An extreme: one parameter that is pushed, what came out at each of its values, and where it broke.

At a value the answer is the `same` as the reference within the tolerance, `refused` with a reason, `off` (an answer
beyond the tolerance) or a `fault` (an exception or a number that is not finite). An extreme is green if all up to the
value that is asked for is the same, and what is beyond ends as it may: by refusal only, or by a loss of accuracy
where the parameter is a resolution, whose error grows with it and is the user's choice.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import isfinite
from time import perf_counter
from typing import NamedTuple

from fabfem.case import CaseError

SAME, REFUSED, OFF, FAULT = "same", "refused", "off", "fault"


class Found(NamedTuple):
    """What a run gave."""

    got: float | None
    """The answer, None where the run was refused."""
    reference: float
    reason: str = ""
    """Why it was refused."""


class Outcome(NamedTuple):
    """What came out at a value of the parameter."""

    value: float
    kind: str
    """``same``, ``refused``, ``off`` or ``fault``."""
    error: float | None
    """Relative error, None where there is no answer."""
    reason: str


@dataclass(frozen=True)
class Extreme:
    """A sweep, milder values first.

    Attributes
    ----------
    what : str
        What is run and compared.
    parameter : str
        What is pushed.
    tolerance : float
        Largest relative error that counts as the same answer.
    asked : float
        The value up to which the answer has to be the same.
    resolution : bool
        Whether the parameter is a resolution, so that beyond `asked` the error may grow.
    outcomes : tuple of Outcome
    seconds : float
        Wall time of all runs.
    """

    what: str
    parameter: str
    tolerance: float
    asked: float
    resolution: bool
    outcomes: tuple[Outcome, ...]
    seconds: float

    @property
    def broke(self) -> int:
        """Number of the first outcome that is not the same; their count where all are."""
        kinds = [outcome.kind for outcome in self.outcomes]
        return next((number for number, kind in enumerate(kinds) if kind != SAME), len(kinds))

    @property
    def green(self) -> bool:
        """Whether it held as far as asked and ended as it may."""
        values = [outcome.value for outcome in self.outcomes]
        may = {SAME, REFUSED, OFF} if self.resolution else {SAME, REFUSED}
        return self.broke > values.index(self.asked) and {outcome.kind for outcome in self.outcomes} <= may

    @property
    def held_until(self) -> float | None:
        """The last value before it broke."""
        return self.outcomes[self.broke - 1].value if self.broke else None

    @property
    def worst(self) -> float:
        """The largest error where the answer is the same."""
        return max((abs(outcome.error or 0.0) for outcome in self.outcomes[: self.broke]), default=0.0)

    @property
    def end(self) -> str:
        """How it broke, in a phrase."""
        if self.broke == len(self.outcomes):
            return "not within the sweep"
        first = self.outcomes[self.broke]
        error = "" if first.error is None else f" by {100.0 * first.error:+.2g} %"
        return f"{first.value:g}: {first.kind}{error}{': ' if first.reason else ''}{first.reason}"


def sweep(
    what: str,
    parameter: str,
    values: Sequence[float],
    run: Callable[[float], Found],
    tolerance: float,
    asked: float,
    resolution: bool = False,
) -> Extreme:
    """Return what `run` gives at ascending extremity; nothing that it raises goes through."""
    start = perf_counter()
    outcomes = tuple(_outcome(value, run, tolerance) for value in values)
    return Extreme(what, parameter, tolerance, asked, resolution, outcomes, perf_counter() - start)


def _outcome(value: float, run: Callable[[float], Found], tolerance: float) -> Outcome:
    try:
        got, reference, reason = run(value)
    except (CaseError, ValueError) as refusal:
        return Outcome(value, REFUSED, None, str(refusal))
    except Exception as fault:  # what a user would see as a traceback is what is looked for here
        return Outcome(value, FAULT, None, f"{type(fault).__name__}: {fault}")
    if got is None:
        return Outcome(value, REFUSED if reason else FAULT, None, reason or "refused without a reason")
    if not isfinite(got):
        return Outcome(value, FAULT, None, "not a number")
    error = got / reference - 1.0 if reference else got
    return Outcome(value, SAME if abs(error) <= tolerance else OFF, error, "")
