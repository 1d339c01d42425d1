"""What `fabfem verify` prints: a table for each problem as soon as it is done, or all rows as JSON."""

import json
import sys
from collections.abc import Mapping, Sequence
from time import perf_counter

from rich.box import SIMPLE
from rich.console import Console
from rich.table import Table

from fabfem.verification.problems import Problem, rows
from fabfem.verification.row import Row

WIDTH = 140
"""Characters in a line where there is no terminal that says its width."""


def verify(problems: Mapping[str, Problem], as_json: bool = False, quiet: bool = False) -> bool:
    """Run problems, print what came out, and return whether every row is green."""
    start, console = perf_counter(), Console(quiet=quiet or as_json, width=None if sys.stdout.isatty() else WIDTH)
    done: dict[str, list[Row]] = {}
    for name, problem in problems.items():
        done[name] = list(rows(problem))
        console.print(table(f"{problem.title} ({name})", done[name]))
    every = [row for found in done.values() for row in found]
    red = sum(not row.green for row in every)
    console.print(f"{len(every)} rows: {len(every) - red} green, {red} red, {perf_counter() - start:.0f} s")
    if as_json:
        print(json.dumps([entry(name, row) for name, found in done.items() for row in found], indent=1))
    return not red


def table(title: str, found: Sequence[Row]) -> Table:
    """Return the rows of a problem as the terminal shows them."""
    shown = Table(title=title, title_justify="left", title_style="bold", box=SIMPLE)
    shown.add_column("what", no_wrap=True)
    for heading in ("reference", "got", "error", "allowed", "time"):
        shown.add_column(heading, justify="right", no_wrap=True)
    shown.add_column("verdict", no_wrap=True)
    shown.add_column("how, or why not", no_wrap=all(row.green for row in found))
    for row in found:
        shown.add_row(*cells(row), style=None if row.green else "bold red")
    return shown


def cells(row: Row) -> tuple[str, ...]:
    """Return name, reference, got, error, tolerance, time, verdict and note as they are written in tables."""
    got = "-" if row.got is None else f"{row.got:.6g}"
    error = "-" if row.error is None else f"{100.0 * row.error:+.2f} %"
    time = f"{row.seconds:.1f} s" if row.seconds else ""
    return row.name, f"{row.reference:.6g}", got, error, f"{100.0 * row.tolerance:g} %", time, row.verdict, row.note


def entry(problem: str, row: Row) -> dict[str, object]:
    """Return a row as it is written in JSON."""
    return {
        "problem": problem,
        "name": row.name,
        "reference": row.reference,
        "got": row.got,
        "error": row.error,
        "tolerance": row.tolerance,
        "verdict": row.verdict,
        "seconds": row.seconds,
        "note": row.note,
    }
