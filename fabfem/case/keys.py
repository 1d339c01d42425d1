"""The keys of a case, table by table, for people: what each is, what it may be, and what it is when left out.

They are read off the JSON Schema (`fabfem.case.json_schema`), which is made from the tables that read a case.
"""

import json
from collections.abc import Iterator
from typing import Any, NamedTuple

from fabfem.case.json_schema import schema

SCENES = {"BoundaryValueCase": "boundary_value", "ElementCase": "element", "FabricCase": "fabric"}
LIMITS = {"exclusiveMinimum": "> ", "minimum": "≥ ", "exclusiveMaximum": "< ", "maximum": "≤ "}
PLAIN = {"number": "number", "integer": "whole number", "string": "text", "boolean": "true or false"}
SHORT = "ShortUmat"
"""Another way to write a table that is there already."""
NAME = "NAME"
"""Stands for what the user calls a thing."""


class Key(NamedTuple):
    """One key of a table."""

    name: str
    value: str
    """What it may be."""
    default: str
    """What it is when left out, in TOML; empty where it must be there, ``–`` where it is then absent."""
    what: str


class Keys(NamedTuple):
    """The keys of a table, or of one of the kinds that a table may be."""

    place: str
    """Header of the table in the file; empty for the head of the file."""
    kind: str
    """What tells it from other tables at the place, such as ``kind = "load"``; empty where it is alone, or for all."""
    what: str
    keys: tuple[Key, ...]
    scenes: tuple[str, ...]
    """Kinds of scenes that have it."""


def keys(place: str = "") -> list[Keys]:
    """Return the tables of all scenes, or those at a place such as ``stage`` and below, in the order of the file."""
    tables = schema()["$defs"]
    found: dict[tuple[str, str], Keys] = {}
    for name, scene in SCENES.items():
        for at, table in _tables(tables, "", name):
            scenes = found[at].scenes if at in found else ()
            found[at] = table._replace(scenes=scenes if scene in scenes else (*scenes, scene))
    inside = place.strip("[] ")
    return _parted(
        [table for table in found.values() if f"{table.place.strip('[]')}.".startswith(inside and f"{inside}.")]
    )


def _parted(tables: list[Keys]) -> list[Keys]:
    """Return tables with all kinds at a place together, and before them what they share, in a table of its own."""
    found: list[Keys] = []
    for table in tables:
        kinds = [other for other in tables if (other.place, other.scenes) == (table.place, table.scenes)]
        shared = tuple(key for key in table.keys if len(kinds) > 1 and all(key in other.keys for other in kinds))
        if table is not kinds[0]:
            continue
        found += [Keys(table.place, "", "", shared, table.scenes)] if shared else []
        found += [one._replace(keys=tuple(key for key in one.keys if key not in shared)) for one in kinds]
    return found


def _tables(named: dict[str, Any], place: str, name: str) -> Iterator[tuple[tuple[str, str], Keys]]:
    """Yield a table and those inside it, with what makes each of them one."""
    table = named[name]
    own = {key: value for key, value in table["properties"].items() if "const" not in value}
    kind = ", ".join(
        f"{key} = {_toml(value['const'])}" for key, value in table["properties"].items() if "const" in value
    )
    required = table.get("required", ())
    rows = tuple(_key(key, value, key in required) for key, value in own.items() if not list(_inner(value, key)))
    yield (place, name), Keys(place, kind, " ".join(table.get("description", "").split()), rows, ())
    for key, value in own.items():
        for header, other in _inner(value, f"{place.strip('[]')}.{key}".lstrip(".")):
            yield from _tables(named, header, other)


def _inner(value: dict[str, Any], place: str) -> Iterator[tuple[str, str]]:
    """Yield the header and name of each table that may stand at a place."""
    if "$ref" in value:
        name = value["$ref"].rpartition("/")[2]
        if name != SHORT:
            yield f"[{place}]", name
    for choice in (*value.get("oneOf", ()), *value.get("anyOf", ())):
        yield from _inner(choice, place)
    for choice in value.get("patternProperties", {}).values():
        yield from _inner(choice, f"{place}.{NAME}")
    if isinstance(value.get("items"), dict):
        for _, name in _inner(value["items"], place):
            yield f"[[{place}]]", name


def _key(name: str, value: dict[str, Any], required: bool) -> Key:
    default = "" if required else _toml(value.get("default"))
    return Key(name, _words(value), default, " ".join(value.get("description", "").split()))


def _words(value: dict[str, Any]) -> str:
    """Return what a value may be."""
    if "const" in value:
        return _toml(value["const"])
    if "enum" in value:
        return ", ".join(_toml(one) for one in value["enum"])
    if "anyOf" in value:
        choices = [one for one in value["anyOf"] if one.get("type") != "null"]
        if {one.get("type") for one in choices} >= set(PLAIN):  # then any value will do
            choices = [{}, *(one for one in choices if one.get("type") not in PLAIN)]
        return " or ".join(dict.fromkeys(_words(one) for one in choices))
    if value.get("type") == "array":
        return _list(value)
    if value.get("type") == "object":
        return f"{_words(value.get('additionalProperties') or {})} by name"
    limits = [f"{sign}{value[limit]:g}" for limit, sign in LIMITS.items() if limit in value]
    return f"{PLAIN.get(str(value.get('type')), 'value')} {', '.join(limits)}".strip()


def _list(value: dict[str, Any]) -> str:
    if "prefixItems" in value:
        return f"[{', '.join(_words(one) for one in value['prefixItems'])}]"
    count = value.get("minItems")
    number = f"{count} " if count is not None and count == value.get("maxItems") else ""
    return f"list of {number}{_words(value.get('items', {}))}"


def _toml(value: Any) -> str:
    """Return a value as a case has it."""
    if value is None:
        return "–"
    if isinstance(value, dict):
        return f"{{ {', '.join(f'{key} = {_toml(one)}' for key, one in value.items())} }}" if value else "{}"
    return json.dumps(value, ensure_ascii=False)
