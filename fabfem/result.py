"""Fabfem in Python: `solve` a case, and look at what it left.

>>> import fabfem
>>> result = fabfem.solve("cases/footing/strip_toyoura.toml")  # doctest: +SKIP
>>> result.history["settlement"], result.units["settlement"]  # doctest: +SKIP
>>> result.dataframe().plot(x="settlement", y="q/(gamma B)")  # doctest: +SKIP
>>> result.grid().plot(scalars="p")  # doctest: +SKIP

A result is its folder: `open_result` gives the same object for a run made by the command, in another process, or still
under way.
"""

import json
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fabfem.case import Case, CaseError, case_from, read_case
from fabfem.output.history import name_and_unit, read_history
from fabfem.output.vtu import frames_of
from fabfem.restart import Restart
from fabfem.run import run_case

if TYPE_CHECKING:
    import pandas


class Result:
    """What a run left in a folder; read when it is asked for, and then kept.

    Parameters
    ----------
    folder : str or Path
        Folder of the result.

    Raises
    ------
    CaseError
        If the folder holds no result.
    """

    def __init__(self, folder: str | Path) -> None:
        self.folder = Path(folder)
        if not (self.folder / "history.csv").is_file():
            raise CaseError(f"{self.folder}: holds no result (there is no history.csv)")

    @cached_property
    def report(self) -> dict[str, Any]:
        """Content of ``report.json``: status, times, residuals, cut-backs, versions, the case as resolved."""
        text = (self.folder / "report.json").read_text(encoding="utf-8")
        return json.loads(text) if text else {"status": "running", "reason": ""}

    @property
    def status(self) -> str:
        """``completed``, ``stopped``, ``interrupted``, or ``running`` where the report has no end yet."""
        return str(self.report["status"])

    @property
    def reason(self) -> str:
        """Why the run ended before its end, in a sentence; empty when completed."""
        return str(self.report["reason"])

    @property
    def completed(self) -> bool:
        """Whether the run came to its end."""
        return self.status == "completed"

    @cached_property
    def history(self) -> dict[str, NDArray[Any]]:
        """Columns of ``history.csv`` by name, without units; one entry for each row, stages are texts."""
        return {name_and_unit(header)[0]: column for header, column in self._columns.items()}

    @cached_property
    def units(self) -> dict[str, str]:
        """Unit of each column, ``-`` for pure numbers, empty for texts."""
        return dict(map(name_and_unit, self._columns))

    @cached_property
    def _columns(self) -> dict[str, NDArray[Any]]:
        headers, rows = read_history(self.folder / "history.csv")
        return {header: _column([row[i] for row in rows]) for i, header in enumerate(headers)}

    def dataframe(self) -> "pandas.DataFrame":
        """Return the history as a table of pandas, its units in ``attrs["units"]``; needs ``fabfem[tables]``."""
        import pandas

        table = pandas.DataFrame(self.history)
        table.attrs["units"] = dict(self.units)
        return table

    @cached_property
    def times(self) -> tuple[float, ...]:
        """Time of each stored increment, none without ``[output]``."""
        return tuple(time for time, _ in self._frames)

    @cached_property
    def _frames(self) -> list[tuple[float, Path]]:
        return frames_of(self.folder)

    def grid(self, number: int = -1) -> Any:
        """Return the mesh with the fields of a stored increment (a pyvista.UnstructuredGrid), the last by default.

        Tensors are in VTK's order (xx, yy, zz, xy, yz, xz), without factors; compression is positive.

        Raises
        ------
        IndexError
            If so many were not stored.
        """
        from fabfem.pictures.grid import read_grid

        if not -len(self._frames) <= number < len(self._frames):
            raise IndexError(f"{self.folder} has {len(self._frames)} stored increments, not one of number {number}")
        return read_grid(self._frames[number][1])

    def show(self) -> tuple[Path, ...]:
        """Draw the pictures of the result into its folder and return their files."""
        from fabfem.pictures.show import show

        return show(self.folder).pictures

    def __repr__(self) -> str:
        rows = len(next(iter(self.history.values()), ()))
        why = f": {self.reason}" if self.reason else ""
        return f"<Result {self.folder}: {self.status} after {rows} rows{why}>"


def open_result(folder: str | Path) -> Result:
    """Return the result in a folder; `CaseError` if there is none."""
    return Result(folder)


def solve(
    case: str | Path | Case | dict[str, Any],
    folder: str | Path | None = None,
    *,
    resume: bool = False,
    branch: str | Path | None = None,
    quiet: bool = True,
) -> Result:
    """Run a case and return its result, however it ended.

    Parameters
    ----------
    case : str, Path, Case or dict
        Case file, a case that was read, or the tables of one (files that it names are then beside the current folder).
    folder : str or Path, optional
        Where the results go, ``results/CASE`` by default.
    resume : bool
        Go on from the last checkpoint in the folder, if there is one.
    branch : str or Path, optional
        Folder of another run, from whose last state this one begins.
    quiet : bool
        Show no progress.

    Raises
    ------
    CaseError
        If the case cannot be run, or its folder not be written, in one sentence.
    OSError
        If the disk is full, or the like; what was written is kept.
    """
    if isinstance(case, dict):
        case = case_from(case)
    elif not isinstance(case, Case):
        case = read_case(case)
    where = Path(folder) if folder is not None else Path("results") / case.path.stem
    outcome = run_case(case, where, quiet, Restart(resume, Path(branch) if branch is not None else None))
    if outcome.status == "unwritten":
        raise OSError(outcome.reason)
    return Result(where)


def _column(values: list[str]) -> NDArray[Any]:
    """Return whole numbers, numbers (NaN where there is none) or texts."""
    for kind in (int, float):
        try:
            return np.array([kind(value) if value or kind is int else np.nan for value in values], dtype=kind)
        except ValueError:
            continue
    return np.array(values, dtype=str)
