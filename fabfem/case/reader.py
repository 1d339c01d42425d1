"""The strict reader: TOML file to `Case`, or one sentence on what is wrong and where."""

import tomllib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from fabfem.case.boundary_value import BoundaryValueCase
from fabfem.case.contradictions import contradictions
from fabfem.case.element import ElementCase
from fabfem.case.element import contradictions as element_contradictions
from fabfem.case.fabric import FabricCase
from fabfem.case.fabric import contradictions as fabric_contradictions
from fabfem.case.schema import Case
from fabfem.case.sentences import CaseError, sentence
from fabfem.case.table import suggest
from fabfem.case.toml import write_toml

KINDS: dict[str, tuple[type[Case], Callable[[Any], Iterator[tuple[str, str]]]]] = {
    "boundary_value": (BoundaryValueCase, contradictions),
    "fabric": (FabricCase, fabric_contradictions),
    "element": (ElementCase, element_contradictions),
}
"""What a case of each kind of scene may say, and the search for what no single table can see."""


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
    schema, contradicted = KINDS[_kind(tables, path)]
    try:
        case = schema.model_validate(tables)
    except ValidationError as error:
        raise CaseError(f"{path.name}: {sentence(error, tables)}") from error
    case._path = path
    for where, what in contradicted(case):
        raise CaseError(f"{path.name}: {where}: {what}")
    return case


def _kind(tables: dict[str, Any], path: Path) -> str:
    """Return the kind of scene; where none is said, the schema of a boundary-value problem says what is missing."""
    scene = tables.get("scene")
    kind = scene.get("kind") if isinstance(scene, dict) else None
    if kind is None:
        return "boundary_value"
    if kind not in KINDS:
        known = ", ".join(f"'{name}'" for name in KINDS)
        raise CaseError(f"{path.name}: scene.kind: must be one of {known} (got {kind!r}){suggest(str(kind), KINDS)}")
    return kind


def resolved(case: Case) -> str:
    """Return the case with all its defaults as TOML text."""
    return write_toml(case.model_dump())


def read_tables(path: Path) -> dict[str, Any]:
    """Return the tables of a TOML file as they stand; `CaseError` if it cannot be read."""
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
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
