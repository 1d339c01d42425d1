"""JSON Schema (draft 2020-12) of a case file, for editors and other programs.

It is made from the tables themselves, so that it cannot lag behind. What no single table can see (names that fit
together, sums, orders of magnitude) only `fabfem check` knows: a case that the schema accepts may still be refused.
"""

import json
from copy import deepcopy
from typing import Any

from pydantic.json_schema import models_json_schema

from fabfem.case.reader import KINDS

DIALECT = "https://json-schema.org/draft/2020-12/schema"


def schema() -> dict[str, Any]:
    """Return the schema of a case file of any kind of scene."""
    kinds = [kind.schema() for kind in KINDS.values()]
    _, found = models_json_schema([(kind, "validation") for kind in kinds])
    tables = found["$defs"]
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


def _short(umat: dict[str, Any]) -> dict[str, Any]:
    """Return the schema of a routine in its short form, ``umat = LIBRARY`` instead of model and library."""
    short = deepcopy(umat)
    library = {key: value for key, value in short["properties"].pop("library").items() if key != "title"}
    del short["properties"]["model"]
    short["properties"]["umat"] = library
    return short | {"title": "ShortUmat", "required": ["umat"]}
