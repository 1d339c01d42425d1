"""TOML text of the tables of a case.

What is absent (``None``) is left out. An empty list is written: ``zones = []`` is a material for later, no ``zones``
is a material everywhere.
"""

import json
import re
from collections.abc import Iterator, Mapping
from typing import Any

BARE = re.compile(r"[A-Za-z0-9_\-]+\Z")


def write_toml(tables: Mapping[str, Any]) -> str:
    """Return TOML text that reads back as the given tables, less what is ``None``."""
    return "\n\n".join(_blocks(tables, (), "")) + "\n"


def _blocks(table: Mapping[str, Any], path: tuple[str, ...], header: str) -> Iterator[str]:
    """Yield one block of text for the table's own values and one for each table below it."""
    present = {key: value for key, value in table.items() if value is not None}
    own = [f"{_key(key)} = {_value(value)}" for key, value in present.items() if not _is_table(value)]
    if own or header.startswith("[[") or (header and not present):
        yield "\n".join([*filter(None, [header]), *own])
    for key, value in present.items():
        below = (*path, key)
        name = ".".join(_key(part) for part in below)
        if isinstance(value, Mapping):
            yield from _blocks(value, below, f"[{name}]")
        elif _is_table(value):
            for entry in value:
                yield from _blocks(entry, below, f"[[{name}]]")


def _is_table(value: Any) -> bool:
    array = isinstance(value, list | tuple) and len(value) > 0 and all(isinstance(entry, Mapping) for entry in value)
    return array or isinstance(value, Mapping)


def _key(key: str) -> str:
    return key if BARE.match(key) else _text(key)


def _text(value: str) -> str:
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")


def _value(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return _text(value)
    if isinstance(value, list | tuple):
        return f"[{', '.join(_value(entry) for entry in value)}]"
    return repr(value)
