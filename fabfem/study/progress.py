"""What the terminal shows while many runs go on."""

from collections.abc import Iterable, Iterator

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from fabfem.study.store import Run
from fabfem.study.variants import Choice


def shown(runs: Iterable[Run], total: int, quiet: bool = False, console: Console | None = None) -> Iterator[Run]:
    """Yield runs as they end, with a bar that counts them and a line for each that did not complete."""
    if quiet:
        yield from runs
        return
    bar = Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("runs"),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
        console=console or Console(stderr=True),
        transient=True,
    )
    with bar:
        counted = bar.add_task("starting", total=total)
        for run in runs:
            bar.update(counted, advance=1, description=label(run.choice))
            if run.ran.status != "completed":
                said = f"{label(run.choice)}: {run.ran.status}: {run.ran.reason}"
                bar.console.print(said, markup=False, highlight=False)
            yield run


def label(choice: Choice) -> str:
    """Return the settings of a run in a line."""
    return ", ".join(f"{setting.name} {text(setting.value)}" for setting in choice) or "as the case stands"


def text(value: object) -> str:
    """Return a value of a parameter as tables and pictures show it."""
    if isinstance(value, float):
        return f"{value:g}"
    if isinstance(value, list | tuple):
        return "x".join(map(text, value))
    return str(value)
