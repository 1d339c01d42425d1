"""The gallery: all cases of a folder run one after the other, with their pictures, and a table of how it went.

A case with a ``[sweep]`` is swept, any other is solved; both in processes of their own, so that a failure of one costs
itself alone. Runs that are kept from before are not repeated; the time in the table is that of the processors when they
were made, which hardly depends on what else the machine does.
"""

import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from statistics import median
from typing import NamedTuple

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

from fabfem.case import CaseError, read_case, read_tables
from fabfem.output.atomic import write_atomic
from fabfem.pictures.show import show
from fabfem.study.processes import Pool, limits
from fabfem.study.store import Plan, runs
from fabfem.study.sweep import sweep

COLOURS = 64
"""Colours of the copies of pictures."""
RIGHT = "completed"
"""Status of a case whose runs and pictures are all there."""


class Shown(NamedTuple):
    """How a case of the gallery went."""

    case: str
    """Its name."""
    runs: int
    """Runs that were wanted."""
    seconds: float
    """Processor time of them [s]."""
    status: str
    """``completed``, or what kept it from that."""
    reason: str
    """Why, in a sentence; empty when completed."""
    pictures: tuple[str, ...]
    """Files of its pictures."""


def case_files(where: Path) -> list[Path]:
    """Return the case files of a folder, or of the folder of that name in ``cases``.

    Raises
    ------
    CaseError
        If there is no such folder, or no case in it.
    """
    folder = where if where.is_dir() else Path("cases") / where
    if not folder.is_dir():
        raise CaseError(f"{where}: there is no such folder, neither here nor in cases")
    found = sorted(folder.glob("*.toml"))
    if not found:
        raise CaseError(f"{folder}: holds no case (*.toml)")
    return found


def gallery(files: Sequence[Path], folder: Path, quiet: bool = False, pictures: Path | None = None) -> list[Shown]:
    """Run all cases, draw them, and return how each went.

    Parameters
    ----------
    files : sequence of Path
        Case files.
    folder : Path
        Where the results go, a folder for each case, and ``gallery.json``.
    quiet : bool
        Show no progress and no table.
    pictures : Path, optional
        Folder that gets a copy of every picture, ``CASE_PICTURE.png``.
    """
    shown: list[Shown] = []
    for one in _followed(files, folder, quiet):
        shown.append(one)
        write_atomic(folder / "gallery.json", json.dumps([row._asdict() for row in shown], indent=1) + "\n")
        if pictures:
            _copy(one, pictures)
    if not quiet:
        Console().print(_table(shown))
    return shown


def _followed(files: Sequence[Path], folder: Path, quiet: bool) -> Iterator[Shown]:
    """Yield how each case went, with a bar that counts them."""
    folder.mkdir(parents=True, exist_ok=True)
    parts = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("cases"),
        TimeElapsedColumn(),
    )
    with Pool(limits()) as pool, Progress(*parts, console=Console(stderr=True), transient=True, disable=quiet) as bar:
        task = bar.add_task("", total=len(files))
        for file in files:
            bar.update(task, description=file.stem)
            yield _guarded(file, folder / file.stem, pool)
            bar.advance(task)


def _guarded(file: Path, folder: Path, pool: Pool) -> Shown:
    """Return how a case went; whatever goes wrong is said in its row."""
    try:
        return _swept(file, folder, pool) if read_case(file).sweep else _solved(file, folder, pool)
    except CaseError as error:
        return Shown(file.stem, 0, 0.0, "refused", str(error), ())
    except Exception as error:
        return Shown(file.stem, 0, 0.0, "failed", f"{type(error).__name__}: {error}", ())


def _swept(file: Path, folder: Path, pool: Pool) -> Shown:
    done = sweep(file, folder, quiet=True, pool=pool)
    drawn = show(folder).pictures
    left = done.runs - done.completed
    reason = f"{left} of {done.runs} runs did not complete; {done.table} says why" if left else ""
    return Shown(file.stem, done.runs, done.seconds, "incomplete" if left else RIGHT, reason, _names(drawn))


def _solved(file: Path, folder: Path, pool: Pool) -> Shown:
    (run,) = runs(Plan(read_tables(file), file, folder, [()]), pool)
    seconds = median(run.ran.cpu) if run.ran.cpu else 0.0
    drawn = show(run.folder) if run.history() else None
    trouble = run.ran.reason or (drawn.trouble if drawn else "")
    status = "no picture" if run.ran.status == RIGHT and trouble else run.ran.status
    return Shown(file.stem, 1, seconds, status, trouble, _names(drawn.pictures if drawn else ()))


def _names(pictures: Sequence[Path]) -> tuple[str, ...]:
    return tuple(str(picture) for picture in pictures)


def _copy(one: Shown, pictures: Path) -> None:
    from PIL import Image

    pictures.mkdir(parents=True, exist_ok=True)
    for picture in map(Path, one.pictures):  # few colours make the file of a line drawing a third as large
        small = Image.open(picture).convert("RGB").quantize(COLOURS)
        small.save(pictures / f"{one.case}_{picture.name}", optimize=True)


def _table(shown: Sequence[Shown]) -> Table:
    """Return the table that the terminal shows at the end."""
    table = Table("case", "runs", "processor time [s]", "pictures", "status", box=None)
    for row in shown:
        said = f"{row.status}: {row.reason}" if row.reason else row.status
        table.add_row(row.case, str(row.runs), f"{row.seconds:.1f}", str(len(row.pictures)), said)
    table.add_row(
        "all", str(sum(row.runs for row in shown)), f"{sum(row.seconds for row in shown):.1f}",
        str(sum(len(row.pictures) for row in shown)), "",
    )  # fmt: skip
    return table
