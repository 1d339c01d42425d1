"""The strict reader: TOML file to `Case`, or one sentence on what is wrong and where."""

import tomllib
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from fabfem.case.contradictions import contradictions
from fabfem.case.schema import Case
from fabfem.case.sentences import CaseError, sentence
from fabfem.case.table import suggest
from fabfem.case.toml import write_toml


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
    return case_from(_load(path), path)


def case_from(tables: dict[str, Any], path: str | Path = "case.toml") -> Case:
    """Return the case made of tables that were read already; relative files are looked up beside ``path``."""
    path = Path(path)
    try:
        case = Case.model_validate(tables)
    except ValidationError as error:
        raise CaseError(f"{path.name}: {sentence(error, tables)}") from error
    case._path = path
    for where, what in contradictions(case):
        raise CaseError(f"{path.name}: {where}: {what}")
    return case


def resolved(case: Case) -> str:
    """Return the case with all its defaults as TOML text."""
    return write_toml(case.model_dump())


def _load(path: Path) -> dict[str, Any]:
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
