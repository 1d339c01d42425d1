"""Variants of a case: its tables with other values at some places.

A place is written as the messages about a case write it: keys joined by dots, entries of a list by their name or
counted from 1, ``stage[settlement].increments.maximum`` or ``support[2].fix``. Tables on the way that the case leaves
out are made.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from itertools import product
from typing import Any, NamedTuple

from fabfem.case import CaseError, suggest
from fabfem.case.study import Parameter

Tables = dict[str, Any]
ABOUT_RUNS = ("sweep", "study", "calibration")
"""Tables of a case that say nothing about its own run."""

Placed = tuple[tuple[str, Any], ...]
"""Values by place."""

_STEP = re.compile(r"(?P<key>[A-Za-z_][\w\-]*)(?:\[(?P<entry>[^\]]+)\])?(?:\.|\Z)")


class Setting(NamedTuple):
    """A value and the places that have it."""

    name: str
    places: tuple[str, ...]
    value: Any
    also: Placed = ()
    """Places with values of their own."""


Choice = tuple[Setting, ...]
"""Settings of one run."""


def variant(tables: Mapping[str, Any], settings: Sequence[Setting]) -> Tables:
    """Return the tables of the run with some settings, without what they say about other runs.

    Raises
    ------
    CaseError
        If there is no such place.
    """
    varied = {key: value for key, value in tables.items() if key not in ABOUT_RUNS}
    for setting in settings:
        for place, value in (*setting.also, *((place, setting.value) for place in setting.places)):
            varied = with_value(varied, place, value)
    return varied


def with_value(tables: Mapping[str, Any], place: str, value: Any) -> Tables:
    """Return a copy of tables with a value at a place; what lies beside the place is shared, not copied.

    Raises
    ------
    CaseError
        If there is no such place.
    """
    return _put(tables, tuple(steps(place)), _plain(value), place)


def choices(parameters: Sequence[Parameter]) -> list[Choice]:
    """Return the product of the values of some parameters, the last of which changes fastest."""
    return list(product(*(settings_of(parameter) for parameter in parameters)))


def one_at_a_time(parameters: Sequence[Parameter]) -> list[Choice]:
    """Return the case as it stands, then each value of each parameter alone."""
    return [(), *((setting,) for parameter in parameters for setting in settings_of(parameter))]


def settings_of(parameter: Parameter) -> list[Setting]:
    """Return the settings that a parameter takes; one that is not known by its value has that in `also`."""
    known = parameter.labels or _told_apart(parameter)
    rows = zip(parameter.values, known, _along(parameter), strict=True)
    return [_setting(parameter, value, shown, along) for value, shown, along in rows]


def _setting(parameter: Parameter, value: Any, shown: Any, along: Placed) -> Setting:
    also = (*parameter.set.items(), *along)
    if shown is value:
        return Setting(parameter.name, parameter.at, value, also)
    return Setting(parameter.name, (), shown, (*also, *((place, value) for place in parameter.at)))


def _along(parameter: Parameter) -> list[Placed]:
    """Return what goes with each value, by place."""
    return [tuple((place, row[k]) for place, row in parameter.along.items()) for k in range(len(parameter.values))]


def _told_apart(parameter: Parameter) -> Sequence[Any]:
    """Return the values, or, where two are equal, texts of them with what goes along."""
    if len(set(parameter.values)) == len(parameter.values):
        return parameter.values
    rows = zip(parameter.values, *parameter.along.values(), strict=True)
    return [" ".join(str(_plain(value)) for value in row) for row in rows]


class _Entry(NamedTuple):
    """An entry of a list, by name or counted from 1."""

    called: str

    def number(self, entries: Sequence[Any]) -> int | None:
        """Return its place in the list, or None."""
        names = [entry.get("name") if isinstance(entry, Mapping) else None for entry in entries]
        if self.called in names:
            return names.index(self.called)
        counted = int(self.called) - 1 if self.called.isdigit() else -1
        return counted if 0 <= counted < len(entries) else None


def steps(place: str) -> Iterator[str | _Entry]:
    """Yield the keys and entries that lead to a place; `CaseError` if it is not written like one."""
    at = 0
    while at < len(place) or at == 0:
        found = _STEP.match(place, at)
        if not found:
            raise CaseError(f"'{place}' is no place in a case; write one like stage[NAME].increments.maximum")
        yield found["key"]
        if found["entry"] is not None:
            yield _Entry(found["entry"])
        at = found.end()


def _put(here: Any, path: Sequence[str | _Entry], value: Any, place: str) -> Any:
    """Return a copy of a table or list with a value at the end of a path."""
    if not path:
        return value
    step, rest = path[0], path[1:]
    if isinstance(step, _Entry):
        number = step.number(here) if isinstance(here, list) else None
        if number is None:
            names = [entry["name"] for entry in here or () if isinstance(entry, Mapping) and "name" in entry]
            raise CaseError(f"{place}: there is no entry '{step.called}'{suggest(step.called, names)}")
        return [*here[:number], _put(here[number], rest, value, place), *here[number + 1 :]]
    if not isinstance(here, Mapping | None):
        raise CaseError(f"{place}: there is no table that could hold '{step}'")
    below = (here or {}).get(step)
    return {**(here or {}), step: _put(below, rest, value, place)}


def _plain(value: Any) -> Any:
    """Return a value as TOML has it, with lists instead of tuples."""
    return list(value) if isinstance(value, tuple) else value
