"""What a quantity truly is, by the best means that a study has, and how sure that is."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from fabfem.case import CaseError, suggest
from fabfem.case.study import Knob, Study
from fabfem.study.convergence import richardson
from fabfem.study.quantity import distance
from fabfem.study.variants import Choice, Setting, settings_of
from umat.mandel import Array

Values = Mapping[Choice, Array]
"""Quantity of interest of each run that has it."""


class Known(NamedTuple):
    """The truth, as well as it is known."""

    value: Array
    doubt: float
    """Relative error that it may have itself."""
    how: str
    """Where it comes from, in a sentence."""


def finest(study: Study) -> Choice:
    """Return the settings of the run that counts as true: those that the case names, else every knob's last value."""
    if study.truth is not None and study.truth.reference is not None:
        return tuple(Setting("reference", (place,), value) for place, value in study.truth.reference.items())
    return tuple(settings_of(knob)[-1] for knob in study.knob)


def sizes_of(knob: Knob) -> list[float]:
    """Return the size that goes with each value of a knob."""
    return [float(size) for size in knob.sizes or knob.values]  # type: ignore[arg-type]


def knob_named(study: Study, name: str, case: str) -> Knob:
    """Return a knob; `CaseError` if there is none of that name, or its values have no sizes."""
    known = {knob.name: knob for knob in study.knob}
    if name not in known:
        raise CaseError(f"{case}: study.truth.richardson: there is no knob '{name}'{suggest(name, known)}")
    knob = known[name]
    if knob.sizes is None and any(isinstance(value, str | bool | tuple) for value in knob.values):
        raise CaseError(f"{case}: study.truth.richardson: the values of '{name}' have no sizes")
    return knob


def truth(study: Study, values: Values, case: str) -> Known:
    """Return what the quantity truly is.

    Raises
    ------
    CaseError
        If the runs that it rests on do not have the quantity.
    """
    said = study.truth
    if said is not None and said.exact is not None:
        return Known(np.array([said.exact]), 0.0, "the exact answer that the case names")
    if said is not None and said.richardson is not None:
        return _extrapolated(knob_named(study, said.richardson, case), values, case)
    run = finest(study)
    if run not in values:
        raise CaseError(f"{case}: study.truth: the finest run does not have the quantity of interest")
    doubt = _last_steps(study, values)
    how = "the finest run" if said is None else "the run that the case names"
    return Known(values[run], doubt, f"{how}; the last step of all knobs together changes {100.0 * doubt:.2g} %")


def _extrapolated(knob: Knob, values: Values, case: str) -> Known:
    pairs = [(size, values[(s,)]) for size, s in zip(sizes_of(knob), settings_of(knob), strict=True) if (s,) in values]
    numbers = [(size, float(value[0])) for size, value in pairs if value.ndim == 1]
    if len(numbers) < 2:
        raise CaseError(f"{case}: study.truth.richardson: fewer than two runs along '{knob.name}' have a number")
    sizes, found = zip(*numbers, strict=True)
    limit = richardson(sizes, found, knob.order or 2.0)
    doubt = limit.doubt / abs(limit.value) if limit.value else limit.doubt
    shown = f"at the observed order {limit.order:.2f}" if limit.sure else f"at the order {limit.order:g}, not observed"
    how = f"extrapolation along {knob.name} {shown}; it moves the finest run by {100.0 * doubt:.2g} %"
    return Known(np.array([limit.value]), doubt, how)


def _last_steps(study: Study, values: Values) -> float:
    """Return how much the last steps of all knobs change the quantity, added up."""
    total = 0.0
    for knob in study.knob:
        last = [values[(setting,)] for setting in settings_of(knob) if (setting,) in values][-2:]
        total += distance(*last) if len(last) == 2 else 0.0
    return total
