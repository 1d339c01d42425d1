"""The strict reader: TOML file to `Case`, or one sentence on what is wrong and where."""

import tomllib
from collections.abc import Callable, Iterator
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple

from pydantic import BaseModel, ValidationError

from fabfem.case.materials import spelled_out
from fabfem.case.schema import Case
from fabfem.case.sentences import CaseError, sentence
from fabfem.case.table import suggest
from fabfem.case.toml import write_toml


class Kind(NamedTuple):
    """A kind of scene; its modules are imported when a case is of it."""

    module: str
    table: str
    """What a case of it may say."""
    checks: str
    """Module whose `contradictions` finds what no single table can see."""

    def schema(self) -> type[Case]:
        """Return the table of a case."""
        found: type[Case] = getattr(import_module(f"fabfem.case.{self.module}"), self.table)
        return found

    def contradictions(self, case: Case) -> Iterator[tuple[str, str]]:
        """Return the places in a case that contradict others, and what is wrong there."""
        found: Callable[[Case], Iterator[tuple[str, str]]]
        found = import_module(f"fabfem.case.{self.checks}").contradictions
        return found(case)


KINDS = {
    "boundary_value": Kind("boundary_value", "BoundaryValueCase", "contradictions"),
    "fabric": Kind("fabric", "FabricCase", "fabric"),
    "element": Kind("element", "ElementCase", "element"),
}


def read_case(path: str | Path) -> Case:
    """Return the case of a file, complete with all defaults.

    Parameters
    ----------
    path : str or Path
        TOML file.

    Raises
    ------
    CaseError
        If the file cannot be read or says something impossible; the message is one sentence naming the place.
    """
    path = Path(path)
    return case_from(read_tables(path), path)


def case_from(tables: dict[str, Any], path: str | Path = "case.toml") -> Case:
    """Return the case made of tables that were read already; relative files are looked up beside ``path``."""
    path = Path(path)
    try:
        tables = spelled_out(tables)
    except CaseError as error:
        raise CaseError(f"{path.name}: {error}") from None
    kind = KINDS[_kind(tables, path)]
    try:
        case = kind.schema().model_validate(tables)
    except ValidationError as error:
        what = _table_of_another_kind(tables, kind) or sentence(error, tables)
        raise CaseError(f"{path.name}: {what}") from error
    case._path = path
    for where, what in kind.contradictions(case):
        raise CaseError(f"{path.name}: {where}: {what}")
    return case


def _kind(tables: dict[str, Any], path: Path) -> str:
    """Return the kind of scene; where none is said, the schema of a boundary-value problem says what is missing."""
    scene = tables.get("scene")
    kind = scene.get("kind") if isinstance(scene, dict) else None
    if kind is None:
        return "boundary_value"
    if not isinstance(kind, str) or kind not in KINDS:
        known = ", ".join(f"'{name}'" for name in KINDS)
        raise CaseError(f"{path.name}: scene.kind: must be one of {known} (got {kind!r}){suggest(str(kind), KINDS)}")
    return kind


def _table_of_another_kind(tables: dict[str, Any], kind: Kind) -> str | None:
    """Return a sentence on the first table that only other kinds of scene have, or None."""
    for key in tables:
        if key not in kind.schema().model_fields:
            kinds = [name for name, other in KINDS.items() if key in other.schema().model_fields]
            if kinds:
                said = next(name for name, other in KINDS.items() if other is kind)
                return f"{key}: belongs to a scene of kind {' or '.join(kinds)}, and scene.kind is {said}"
    return None


def resolved(case: Case) -> str:
    """Return the case with all its defaults as TOML text."""
    return write_toml(_said(case))


def _said(table: BaseModel) -> dict[str, Any]:
    """Return the values of a table by key, without what is empty by default."""
    empty = {key for key, field in type(table).model_fields.items() if field.default in ((), {})}
    values = ((key, getattr(table, key)) for key in type(table).model_fields)
    return {key: _plain(value) for key, value in values if value or key not in empty}


def _plain(value: Any) -> Any:
    """Return a value with tables as dictionaries."""
    if isinstance(value, BaseModel):
        return _said(value)
    if isinstance(value, dict):
        return {key: _plain(entry) for key, entry in value.items()}
    return [_plain(entry) for entry in value] if isinstance(value, list | tuple) else value


def read_tables(path: Path) -> dict[str, Any]:
    """Return the tables of a TOML file as they stand; `CaseError` if it cannot be read."""
    try:
        return tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except FileNotFoundError:
        raise CaseError(f"{path}: there is no such file{_beside(path)}") from None
    except OSError as error:
        raise CaseError(f"{path}: cannot be read ({error.strerror or error})") from None
    except UnicodeDecodeError as error:
        raise CaseError(f"{path.name}: is not a UTF-8 text file (byte {error.start})") from None
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise CaseError(f"{path.name}: is not valid TOML: {error}") from None


def _beside(path: Path) -> str:
    files = [file.name for file in path.parent.glob("*.toml")] if path.parent.is_dir() else []
    return suggest(path.name, files) if files else ""
