"""What every drive of a case on fabric laws comes down to: a table with one block of rows after the other."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple

from fabfem.case import CaseError, FabricCase
from fabfem.substance import MisfitError

Value = str | int | float


class Block(NamedTuple):
    """Rows of the history that belong together, such as those of a curve."""

    rows: list[tuple[Value, ...]]
    """Values of the columns; empty text where a value is undefined."""
    summary: dict[str, Any]
    """What the report says about them."""
    reason: str = ""
    """Why they end before their end, in a sentence; empty when they do not."""


class Measured(NamedTuple):
    """A table to be written."""

    headers: tuple[str, ...]
    """Name and unit of each column."""
    blocks: Iterator[Block]
    """Its rows, computed as they are asked for."""
    size: int
    """Number of blocks."""
    remains: tuple[tuple[str, str], ...]
    """Name and size of what is computed."""


@contextmanager
def blamed(case: FabricCase, place: str) -> Iterator[None]:
    """Turn what the physics refuses into a sentence that names the place in the case."""
    try:
        yield
    except CaseError:
        raise
    except MisfitError as error:
        raise CaseError(f"{case.path.name}: {place}.{error.key}: {error}") from error
    except ValueError as error:
        raise CaseError(f"{case.path.name}: {place}: {error}") from error
