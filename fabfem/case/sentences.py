"""One sentence for what is wrong in a case file, naming the place in the file."""

from collections.abc import Mapping, Sequence
from typing import Any

from pydantic import ValidationError
from pydantic_core import ErrorDetails

from fabfem.case.table import nearest

TAGS = ("model", "kind", "law")
"""Keys that choose among several kinds of table; pydantic puts their value into the location of an error."""

WORDING = {
    "missing": "is missing",
    "greater_than": "must be greater than {gt:g}",
    "greater_than_equal": "must be at least {ge:g}",
    "less_than": "must be less than {lt:g}",
    "less_than_equal": "must be at most {le:g}",
    "finite_number": "must be finite",
    "float_type": "must be a number",
    "int_type": "must be a whole number",
    "int_from_float": "must be a whole number",
    "bool_type": "must be true or false",
    "string_type": "must be text in quotes",
    "string_too_short": "must not be empty",
    "string_pattern_mismatch": "must be a name of letters, digits, '_' and '-' that starts with a letter",
    "too_short": "must hold at least {min_length} entries",
    "too_long": "must hold at most {max_length} entries",
    "tuple_type": "must be a list",
    "list_type": "must be a list",
    "dict_type": "must be a table",
    "model_type": "must be a table",
    "model_attributes_type": "must be a table",
    "union_tag_not_found": "is missing",
}


class CaseError(ValueError):
    """A case that cannot be run, as one sentence naming the place in the file."""


def sentence(error: ValidationError, raw: Mapping[str, Any]) -> str:
    """Return ``place: what is wrong`` for the most telling of the errors of a case."""
    details = min(error.errors(include_url=False), key=_rank)
    context = details.get("ctx", {})
    key = context.get("key") or context.get("discriminator", "").strip("'")
    where = ".".join(filter(None, [place(raw, details["loc"]), key]))
    return f"{where or 'the file'}: {_what(details)}"


def place(raw: Any, location: Sequence[int | str]) -> str:
    """Return the dotted place of a location; entries of a list are called by their name, or counted from 1."""
    words: list[str] = []
    here = raw
    for step in location:
        if isinstance(step, int):
            here = here[step] if isinstance(here, list) and step < len(here) else None
            name = here.get("name") if isinstance(here, Mapping) else None
            words.append(f"{words.pop()}[{name if isinstance(name, str) else step + 1}]")
        elif isinstance(here, Mapping) and step not in here and step in [here.get(tag) for tag in TAGS]:
            continue
        else:
            here = here.get(step) if isinstance(here, Mapping) else None
            words.append(step)
    return ".".join(words)


def _rank(details: ErrorDetails) -> int:
    """Return the order of an error: a misspelt key explains the one that is missing."""
    return {"unknown_key": 0, "missing": 2}.get(details["type"], 1)


def _what(details: ErrorDetails) -> str:
    kind, got = details["type"], details.get("input")
    context = details.get("ctx", {})
    if kind in ("literal_error", "union_tag_invalid"):
        return _one_of(got, context)
    if kind in ("tuple_type", "list_type") and isinstance(got, Mapping):
        return f"must be a list of tables: write [[{details['loc'][-1]}]]"
    if kind not in WORDING:
        return details["msg"].removeprefix("Value error, ")
    what = WORDING[kind].format(**context)
    return what if kind in ("missing", "union_tag_not_found") else f"{what} (got {_shown(got)})"


def _one_of(got: Any, context: Mapping[str, Any]) -> str:
    listed = context.get("expected") or context["expected_tags"]
    word = context.get("tag", got)
    close = nearest(str(word), listed.replace(" or ", ", ").replace("'", "").split(", "))
    hint = f"; did you mean '{close}'?" if close else ""
    return f"must be {'one of ' * (',' in listed)}{listed} (got {_shown(word)}){hint}"


def _shown(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, Mapping):
        return "a table"
    if isinstance(value, list | tuple):
        return "a list"
    return repr(value)
