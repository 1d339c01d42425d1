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
    """

    def __init__(self, path: Path, headers: Sequence[str]) -> None:
        self.width = len(headers)
        self._file = path.open("w", encoding="utf-8", newline="")
        self._writer = csv.writer(self._file, lineterminator="\n")
        self._put(headers)

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
