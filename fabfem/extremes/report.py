"""What `fabfem stress` prints: a table of the sweeps, one of the bodies that must be refused, or all as JSON."""

import json
import sys
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from importlib import import_module
from time import perf_counter

from rich.box import SIMPLE
from rich.console import Console
from rich.table import Table

from fabfem.case import CaseError, suggest
from fabfem.extremes.refusals import Refusal, refusals
from fabfem.extremes.sweep import Extreme

GROUPS = {
    "stiff": "Elastic bodies: contrast, flat elements, incompressibility, units",
    "sand": "Chang-Hicher point: pressure, density, fabric, increments, directions, units, liquefaction",
    "strength": "Strength and increments: friction, one increment, snap-back, bare surfaces",
    "agreement": "Linear solvers, threads, repetition",
}
"""Module beside this one whose `extremes()` yields sweeps -> title."""
REFUSALS = "refusals"
WIDTH = 200
"""Characters in a line where there is no terminal that says its width."""


def chosen(names: Sequence[str] = ()) -> tuple[str, ...]:
    """Return the groups of some names, or all.

    Raises
    ------
    CaseError
        If there is no group of a name.
    """
    there = (*GROUPS, REFUSALS)
    for name in names:
        if name not in there:
            raise CaseError(f"--only: there is no group '{name}'{suggest(name, there)}")
    return tuple(name for name in there if not names or name in names)


def run(name: str) -> Iterator[Extreme | Refusal]:
    """Yield what comes out of a group."""
    yield from refusals() if name == REFUSALS else import_module(f"fabfem.extremes.{name}").extremes()


def stress(groups: Sequence[str], as_json: bool = False, quiet: bool = False) -> bool:
    """Run groups, print what came out, and return whether all is green."""
    start, console = perf_counter(), Console(quiet=quiet or as_json, width=None if sys.stdout.isatty() else WIDTH)
    done: dict[str, list[Extreme | Refusal]] = {}
    for name in groups:
        done[name] = list(run(name))
        console.print(table(name, done[name]))
    every = [found for group in done.values() for found in group]
    red = sum(not found.green for found in every)
    console.print(f"{len(every)} rows: {len(every) - red} green, {red} red, {perf_counter() - start:.0f} s")
    if as_json:
        print(json.dumps([entry(name, found) for name, group in done.items() for found in group], indent=1))
    return not red


def headings(name: str) -> tuple[str, ...]:
    """Return the headings of a group's table."""
    if name == REFUSALS:
        return "what", "said", "verdict"
    return "what", "pushed", "tolerance", "asked", "same until", "largest error there", "breaks at", "verdict"


def cells(found: Extreme | Refusal) -> tuple[str, ...]:
    """Return a row as it is written in tables."""
    verdict = "green" if found.green else "red"
    if isinstance(found, Refusal):
        return found.what, found.said, verdict
    held = "-" if found.held_until is None else f"{found.held_until:g}"
    return (
        *(found.what, found.parameter, f"{100.0 * found.tolerance:g} %", f"{found.asked:g}", held),
        *(f"{100.0 * found.worst:.1g} %", found.end, verdict),
    )


def table(name: str, rows: Sequence[Extreme | Refusal]) -> Table:
    """Return the rows of a group as the terminal shows them."""
    title = f"{GROUPS.get(name, 'Bodies that have no answer')} ({name})"
    shown = Table(*headings(name), title=title, title_justify="left", title_style="bold", box=SIMPLE)
    for row in rows:
        shown.add_row(*cells(row), style=None if row.green else "bold red")
    return shown


def entry(name: str, found: Extreme | Refusal) -> dict[str, object]:
    """Return a row as it is written in JSON."""
    common: dict[str, object] = {"group": name, "verdict": "green" if found.green else "red"}
    if isinstance(found, Refusal):
        return common | found._asdict()
    outcomes = [outcome._asdict() for outcome in found.outcomes]
    return common | asdict(found) | {"outcomes": outcomes, "held_until": found.held_until, "end": found.end}
