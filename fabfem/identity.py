"""What decides the numbers of a run: the case with all defaults, the files that it names, and the program.

Two runs with the same identity on the same machine give the same numbers to the last bit, as long as the cache of
compiled kernels is kept: compiled once more, after others in one process, a kernel may round differently.
"""

import hashlib
import json
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from fabfem.case import Case
from fabfem.output.report import versions

ASIDE = {"title", "checkpoint", "sweep", "study", "calibration"}
"""Tables of a case that do not change its numbers."""


def identity(case: Case, **files: str) -> dict[str, Any]:
    """Return the identity of a run: ``case``, ``version``, the `files` (name -> hash) and the ``hash`` of all."""
    told = json.loads(json.dumps(case.model_dump(mode="json", exclude_none=True, exclude=ASIDE)))
    found = {"case": told, "version": versions() | {"sources": sources()}, **files}
    return found | {"hash": hashed(json.dumps(found, sort_keys=True).encode())}


def hashed(*parts: bytes | np.ndarray) -> str:
    """Return a hash of bytes and arrays."""
    digest = hashlib.sha256()
    for part in parts:
        digest.update(part if isinstance(part, bytes) else str((part.shape, part.dtype.str)).encode())
        digest.update(b"" if isinstance(part, bytes) else np.ascontiguousarray(part).tobytes())
    return digest.hexdigest()[:16]


@cache
def sources() -> str:
    """Return a hash of the program's own sources, which tells versions under development apart."""
    home = Path(__file__).parent
    files = sorted(file for package in (home, home.parent / "umat") for file in package.rglob("*.py"))
    return hashed(*(file.read_bytes() for file in files))


def differences(then: Mapping[str, Any], now: Mapping[str, Any]) -> list[str]:
    """Return what differs between two identities, each place with both values; empty where they are the same."""
    if then.get("hash") == now["hash"]:
        return []
    return list(_differing(then, now, ""))


def _differing(then: Any, now: Any, place: str) -> Iterator[str]:
    if isinstance(then, dict) and isinstance(now, dict):
        for key in (*then, *(key for key in now if key not in then)):
            if place or key != "hash":
                yield from _differing(then.get(key), now.get(key), f"{place}.{key}" if place else key)
    elif isinstance(then, list) and isinstance(now, list) and len(then) == len(now):
        for number, (old, new) in enumerate(zip(then, now, strict=True), 1):
            name = new.get("name", number) if isinstance(new, dict) else number
            yield from _differing(old, new, f"{place}[{name}]")
    elif then != now:
        yield f"{place.removeprefix('case.')} was {_said(then)} and is {_said(now)}"


def _said(value: Any) -> str:
    if value is None:
        return "absent"
    text = json.dumps(value)
    return text if len(text) <= 60 else f"{text[:57]}..."
