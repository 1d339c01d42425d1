"""JSON Schema (draft 2020-12) of a case file, for editors and other programs.

It is made from the tables themselves, so that it cannot lag behind. What no single table can see (names that fit
together, sums, orders of magnitude) only `fabfem check` knows: a case that the schema accepts may still be refused.
"""

import ast
import inspect
import json
from collections.abc import Iterator
from copy import deepcopy
from itertools import pairwise
from textwrap import dedent
from typing import Any

from pydantic.json_schema import models_json_schema

from fabfem.case.reader import KINDS
from fabfem.case.table import Table

DIALECT = "https://json-schema.org/draft/2020-12/schema"


def schema() -> dict[str, Any]:
    """Return the schema of a case file of any kind of scene."""
    kinds = [kind.schema() for kind in KINDS.values()]
    _, found = models_json_schema([(kind, "validation") for kind in kinds])
    tables = found["$defs"]
    _describe(tables, Table)
    tables["ShortUmat"] = _short(tables["Umat"])
    for kind in kinds:
        materials = tables[kind.__name__]["properties"]["material"]["patternProperties"]
        for names, material in materials.items():
            materials[names] = {"oneOf": [*material["oneOf"], {"$ref": "#/$defs/ShortUmat"}]}
    return {
        "$schema": DIALECT,
        "title": "Case file of fabfem",
        "oneOf": [{"$ref": f"#/$defs/{kind.__name__}"} for kind in kinds],
        "$defs": tables,
    }


def schema_text() -> str:
    """Return the schema as the text of a file."""
    return json.dumps(schema(), indent=1, ensure_ascii=False) + "\n"


def _describe(tables: dict[str, Any], table: type[Table]) -> None:
    """Give the keys of a table and of all that inherit from it the docstrings beneath them as descriptions.

    Only the schema needs them: pydantic would look for them in the sources whenever a case is read.
    """
    unique = f"{table.__module__}.{table.__name__}".replace(".", "__")  # where two tables have one name
    keys = tables.get(unique, tables.get(table.__name__, {})).get("properties", {})
    told: dict[str, str] = {}
    for kind in reversed(table.__mro__[: table.__mro__.index(Table)]):
        told = {key: what for key, what in told.items() if key not in kind.__annotations__} | dict(_docstrings(kind))
    for key in keys.keys() & told.keys():
        keys[key]["description"] = told[key]
    for kind in table.__subclasses__():
        _describe(tables, kind)


def _docstrings(table: type) -> Iterator[tuple[str, str]]:
    """Yield the keys of a class and the docstrings beneath them."""
    (body,) = ast.parse(dedent(inspect.getsource(table))).body
    assert isinstance(body, ast.ClassDef)
    for key, below in pairwise(body.body):
        match key, below:
            case ast.AnnAssign(target=ast.Name(id=name)), ast.Expr(value=ast.Constant(value=str(told))):
                yield name, inspect.cleandoc(told)


def _short(umat: dict[str, Any]) -> dict[str, Any]:
    """Return the schema of a routine in its short form, ``umat = LIBRARY`` instead of model and library."""
    short = deepcopy(umat)
    library = {key: value for key, value in short["properties"].pop("library").items() if key != "title"}
    del short["properties"]["model"]
    short["properties"]["umat"] = library
    return short | {"title": "ShortUmat", "required": ["umat"]}
