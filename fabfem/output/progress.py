"""What the terminal shows while a run goes on, and the summary that closes it."""

import sys
from collections.abc import Sequence
from types import TracebackType
from typing import TYPE_CHECKING, Self

if TYPE_CHECKING:
    from rich.console import Console


class Quiet:
    """Shows nothing."""

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        return None

    def say(self, line: str) -> None:
        """Show a line of text."""

    def advance(self, stage: str, done: float, increment: int, iterations: int) -> None:
        """Show that an increment has converged."""


class Lines(Quiet):
    """The lines alone, for a file or a pipe."""

    def say(self, line: str) -> None:
        """Show a line of text."""
        print(line, file=sys.stderr)


class Terminal(Quiet):
    """A bar with stage, increment, iterations and the time left."""

    def __init__(self, stages: int, console: "Console | None" = None) -> None:
        from rich.console import Console
        from rich.progress import (
            BarColumn,
            Progress,
            TaskProgressColumn,
            TextColumn,
            TimeElapsedColumn,
            TimeRemainingColumn,
        )

        self._bar = Progress(
            TextColumn("{task.description:<14}"),
            BarColumn(),
            TaskProgressColumn(),
            TextColumn("increment {task.fields[increment]}, {task.fields[iterations]} iterations"),
            TimeElapsedColumn(),
            TextColumn("left"),
            TimeRemainingColumn(),
            console=console or Console(stderr=True),
            transient=True,
        )
        self._task = self._bar.add_task("starting", total=float(stages), increment=0, iterations=0)

    def __enter__(self) -> Self:
        self._bar.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._bar.stop()

    def say(self, line: str) -> None:
        """Show a line of text above the bar."""
        self._bar.console.print(line, markup=False, highlight=False)

    def advance(self, stage: str, done: float, increment: int, iterations: int) -> None:
        """Move the bar to ``done`` stages, of which the last may be a fraction."""
        self._bar.update(self._task, description=stage, completed=done, increment=increment, iterations=iterations)


def shown(quiet: bool, stages: int) -> Quiet:
    """Return what shows a run of so many stages: nothing, its lines, or a bar where there is a terminal to draw it."""
    if quiet:
        return Quiet()
    return Terminal(stages) if sys.stderr.isatty() else Lines()


def summary(lines: Sequence[tuple[str, str]], prefix: str = "  ") -> str:
    """Return aligned ``name  value`` lines."""
    width = max((len(name) for name, _ in lines), default=0)
    return "\n".join(f"{prefix}{name:<{width}}  {value}" for name, value in lines)
