"""What a study comes to: orders of convergence, the cheapest settings, and the error that dominates."""

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

from fabfem.case.study import Knob, Study
from fabfem.study.convergence import ROUNDING, cheapest, fitted_order, richardson
from fabfem.study.progress import label
from fabfem.study.quantity import distance
from fabfem.study.store import Run
from fabfem.study.truth import Known, Values, sizes_of
from fabfem.study.variants import Choice, Setting, settings_of
from umat.mandel import Array

WANTED = (0.05, 0.01, 0.001)
"""Errors for which the cheapest setting is named."""


class Measured(NamedTuple):
    """A run, its error and its time."""

    run: Run
    value: Array | None
    """Quantity of interest, if the run has it."""
    error: float
    """Distance from the truth."""
    wall: float
    """Median of the wall times [s]."""
    cpu: float
    """Median of the processor times [s]."""
    trouble: str
    """Why the run did not complete or lacks the quantity."""

    def time(self, clock: str) -> float:
        """Return the time by a clock, ``wall`` or ``cpu`` [s]."""
        return self.wall if clock == "wall" else self.cpu


class Order(NamedTuple):
    """Order of convergence along a knob."""

    knob: str
    expected: float
    observed: float
    """Slope of the errors of the finer runs; NaN where they are lost in rounding."""
    by_differences: float
    """Order that the three finest values show by themselves, whatever the truth; NaN where they show none."""


class Standing(NamedTuple):
    """Error of the case with its own settings."""

    error: float
    """Distance from the truth."""
    shares: dict[str, float]
    """What each knob changes when it alone is turned to its last value."""


def orders(study: Study, rows: Sequence[Measured], values: Values) -> Iterator[Order]:
    """Yield the orders of the knobs that have an expected one."""
    errors = {row.run.choice: row.error for row in rows}
    for knob in study.knob:
        if knob.order is None:
            continue
        series = [
            (size, choice)
            for size, choice in zip(sizes_of(knob), along(study, knob), strict=True)
            if choice in values and choice in errors
        ]
        sizes = [size for size, _ in series]
        numbers = [float(values[choice][0]) for _, choice in series if values[choice].ndim == 1]
        limit = richardson(sizes, numbers) if len(numbers) == len(sizes) > 2 else None
        own = limit.order if limit is not None and limit.sure else float("nan")
        yield Order(knob.name, knob.order, fitted_order(sizes, [errors[choice] for _, choice in series]), own)


def along(study: Study, knob: Knob) -> list[Choice]:
    """Return the runs along a knob: the others as the case has them, in a product at their last values."""
    if study.turn == "one_at_a_time":
        return [(setting,) for setting in settings_of(knob)]
    last = [settings_of(other)[-1] for other in study.knob]
    return [_replaced(last, setting) for setting in settings_of(knob)]


def _replaced(settings: Sequence[Setting], new: Setting) -> Choice:
    return tuple(new if setting.name == new.name else setting for setting in settings)


def sentences(study: Study, rows: Sequence[Measured], known: Known, values: Values) -> Iterator[str]:
    """Yield what the study comes to, a sentence each."""
    number = f" {known.value[0]:.7g}" if known.value.ndim == 1 else ""
    yield f"The true {study.quantity.column}{number} is {known.how}."
    for order in orders(study, rows, values):
        yield _order(order)
    for largest in WANTED:
        yield _cheapest(study, rows, largest, known)
    yield from _dominating(study, rows, values)
    lost = [label(row.run.choice) for row in rows if row.value is None]
    if lost:
        yield f"Without the quantity of interest ended: {'; '.join(lost)}."


def _order(order: Order) -> str:
    own = f", {order.by_differences:.2f} by the values alone" if order.by_differences == order.by_differences else ""
    seen = "hidden by rounding" if order.observed != order.observed else f"{order.observed:.2f}"
    return f"Order of convergence along {order.knob}: {seen} (expected {order.expected:g}{own})."


def _cheapest(study: Study, rows: Sequence[Measured], largest: float, known: Known) -> str:
    clock = "wall" if study.clock == "wall" else "processor"
    best = cheapest([row.time(study.clock) for row in rows], [row.error for row in rows], largest)
    if best is None:
        return f"No setting has an error of at most {100.0 * largest:g} %."
    row = rows[best]
    doubt = "; the truth itself is no surer than that" if known.doubt > largest else ""
    return (
        f"Cheapest for {100.0 * largest:g} %: {label(row.run.choice)} "
        f"({row.time(study.clock):.3g} s of {clock} time, error {100.0 * row.error:.2g} %{doubt})."
    )


def standing(study: Study, rows: Sequence[Measured], values: Values) -> Standing | None:
    """Return the error of the case as it stands; None if that run has no quantity of interest."""
    if () not in values:
        return None
    shares = {
        knob.name: distance(values[()], values[(settings_of(knob)[-1],)])
        for knob in study.knob
        if not knob.set and (settings_of(knob)[-1],) in values
    }
    return Standing(next(row.error for row in rows if row.run.choice == ()), shares)


def _dominating(study: Study, rows: Sequence[Measured], values: Values) -> Iterator[str]:
    """Yield which knob's error dominates at the case's own settings."""
    own = standing(study, rows, values)
    if own is not None and max(own.shares.values(), default=0.0) > ROUNDING:
        worst = max(own.shares, key=lambda name: own.shares[name])
        yield (
            f"As the case stands the error is {100.0 * own.error:.2g} %; each knob turned alone to its last value "
            f"changes the quantity: {listed(own.shares)}. The error of the {worst} dominates."
        )


def listed(shares: Mapping[str, float]) -> str:
    """Return the shares of the knobs in words."""
    return ", ".join(f"{name} {100.0 * share:.2g} %" for name, share in shares.items())
