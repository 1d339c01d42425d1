"""``history.csv``: one row per converged increment, flushed row by row, units in the header."""

import csv
from collections.abc import Sequence
from pathlib import Path


class History:
    """The table of a run, open for appending rows.

    Parameters
    ----------
    path : Path
        File to write, replaced if it is there.
    headers : sequence of str
        Name and unit of each column.
    kept : int, optional
        Size of an earlier run's table to go on from [bytes]; what is behind it is cut off.

    Raises
    ------
    OSError
        If the file cannot be written, or is shorter than what is to be kept.
    """

    def __init__(self, path: Path, headers: Sequence[str], kept: int = 0) -> None:
        self.width = len(headers)
        if kept and (not path.is_file() or path.stat().st_size < kept):
            raise OSError(0, "is shorter than when the checkpoint was written; the run cannot go on from there", path)
        self._file = path.open("r+" if kept else "w", encoding="utf-8", newline="")
        self._writer = csv.writer(self._file, lineterminator="\n")
        if kept:
            self._file.seek(kept)
            self._file.truncate()
        else:
            self._put(headers)

    @property
    def size(self) -> int:
        """Size so far [bytes]."""
        return self._file.tell()

    def write(self, row: Sequence[str | int | float]) -> None:
        """Append a row, one value per column, and hand it to the operating system at once."""
        if len(row) != self.width:
            raise ValueError(f"a row of {len(row)} values does not fit {self.width} columns")
        self._put(row)

    def _put(self, row: Sequence[str | int | float]) -> None:
        self._writer.writerow([repr(float(value)) if isinstance(value, float) else value for value in row])
        self._file.flush()

    def close(self) -> None:
        """Close the file."""
        self._file.close()


class Unheard(History):
    """The table of a run on a process that writes none."""

    def __init__(self, headers: Sequence[str]) -> None:
        self.width = len(headers)

    @property
    def size(self) -> int:
        """Nothing."""
        return 0

    def _put(self, row: Sequence[str | int | float]) -> None:
        """Write nothing."""

    def close(self) -> None:
        """Close nothing."""


def name_and_unit(header: str) -> tuple[str, str]:
    """Return the name of a column and its unit, ``-`` for a pure number, empty for a text."""
    name, _, unit = header.removesuffix("]").rpartition(" [")
    return (name, unit) if name else (header, "")


def number_of(text: str) -> float:
    """Return an entry of a table; NaN where it is none, or empty."""
    try:
        return float(text)
    except ValueError:
        return float("nan")


def read_history(path: Path) -> tuple[list[str], list[list[str]]]:
    """Return the header and the rows of a history; a last line cut short by a kill is dropped.

    Raises
    ------
    ValueError
        If the file has no header.
    """
    text = path.read_text(encoding="utf-8")
    lines = list(csv.reader(text[: text.rfind("\n") + 1].splitlines()))
    if not lines:
        raise ValueError(f"{path} is empty")
    return lines[0], [line for line in lines[1:] if len(line) == len(lines[0])]
