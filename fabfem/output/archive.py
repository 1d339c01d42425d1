"""One file for a value made of records, tables, arrays and plain values: a numpy archive (``.npz``) and a table in it.

Numbers come back to the last bit. A record (named tuple or dataclass) is stored by the name of its class and its
fields; only classes of this program are made again when a file is read, and nothing in a file is executed.
"""

import json
import os
from dataclasses import fields, is_dataclass
from importlib import import_module
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np

PACKAGES = ("fabfem", "umat")
"""Packages whose classes may come back."""
TABLE = "table"


class ArchiveError(ValueError):
    """A file that is no archive of this program, or not a whole one."""


def write_archive(path: Path, value: Any) -> None:
    """Write a value aside and rename it into place, so that a reader finds a whole file or none."""
    arrays: dict[str, np.ndarray] = {}
    table = json.dumps(_packed(value, arrays))
    aside = path.with_name(f".{path.name}.part")
    with aside.open("wb") as file:
        np.savez(file, allow_pickle=False, **{TABLE: np.array(table)}, **arrays)
        file.flush()
        os.fsync(file.fileno())
    aside.replace(path)


def read_archive(path: Path) -> Any:
    """Return the value of a file.

    Raises
    ------
    ArchiveError
        If the file is no archive, is cut short, or has a record that this version of the program does not know.
    OSError
        If it cannot be read.
    """
    try:
        with np.load(path, allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
        return _unpacked(json.loads(str(arrays[TABLE])), arrays)
    except (BadZipFile, KeyError, ValueError, EOFError, TypeError, ImportError, AttributeError) as error:
        raise ArchiveError(f"{path} is no file of this program, or is damaged ({error})") from None


def _packed(value: Any, arrays: dict[str, np.ndarray]) -> Any:
    """Return plain values that stand for a value, and put its arrays aside."""
    if value is None or (isinstance(value, bool | int | float | str) and not isinstance(value, np.generic)):
        return value
    if isinstance(value, np.ndarray | np.generic):
        name = f"a{len(arrays)}"
        arrays[name] = np.asarray(value)
        return {"array": name}
    if isinstance(value, slice):
        return {"slice": [_packed(part, arrays) for part in (value.start, value.stop, value.step)]}
    if isinstance(value, dict):
        return {"table": [[_packed(key, arrays), _packed(entry, arrays)] for key, entry in value.items()]}
    if names := _fields(value):
        kept = {name: _packed(getattr(value, name), arrays) for name in names}
        return {"record": f"{type(value).__module__}:{type(value).__name__}", "fields": kept}
    if isinstance(value, list | tuple):
        kind = "list" if isinstance(value, list) else "tuple"
        return {kind: [_packed(part, arrays) for part in value]}
    raise TypeError(f"{type(value).__name__} cannot be kept in a file")


def _fields(value: Any) -> tuple[str, ...]:
    """Return the names of a record's fields; nothing where it is none."""
    if is_dataclass(value):
        return tuple(field.name for field in fields(value))
    return tuple(getattr(value, "_fields", ()))


def _unpacked(packed: Any, arrays: dict[str, np.ndarray]) -> Any:
    if not isinstance(packed, dict):
        return packed
    if "array" in packed:
        return arrays[packed["array"]]
    if "record" in packed:
        given = {name: _unpacked(part, arrays) for name, part in packed["fields"].items()}
        return _class(packed["record"])(**given)
    if "table" in packed:
        return {_unpacked(key, arrays): _unpacked(entry, arrays) for key, entry in packed["table"]}
    ((kind, parts),) = packed.items()
    kinds: dict[str, Any] = {"list": list, "tuple": tuple, "slice": lambda parts: slice(*parts)}
    return kinds[kind]([_unpacked(part, arrays) for part in parts])


def _class(name: str) -> Any:
    module, _, own = name.partition(":")
    found = getattr(import_module(module), own) if module.split(".")[0] in PACKAGES else None
    if not isinstance(found, type) or not (is_dataclass(found) or hasattr(found, "_fields")):
        raise ValueError(f"there is no record {name}")
    return found
