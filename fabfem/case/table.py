"""What every table of a case file has in common: it is strict, closed and frozen.

A key nobody knows is refused with the nearest one that exists, a number given as text is refused, and nothing can
be changed after reading. The attribute docstrings become the descriptions of the JSON Schema.
"""

import difflib
from collections.abc import Iterable, Mapping
from typing import Annotated, Any

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, model_validator
from pydantic_core import PydanticCustomError

Positive = Annotated[float, Field(gt=0)]
NotNegative = Annotated[float, Field(ge=0)]
Angle = Annotated[float, Field(ge=-360, le=360)]
Text = Annotated[str, Field(min_length=1)]
Identifier = Annotated[str, Field(pattern=r"^[A-Za-z_][A-Za-z0-9_\-]*$")]


def _as_list(value: Any) -> Any:
    return value if isinstance(value, list | tuple) else [value]


Names = Annotated[
    tuple[Text, ...],
    BeforeValidator(_as_list, json_schema_input_type=str | list[str]),
    Field(min_length=1, strict=False),
]
"""One name or a list of names."""

SomeNames = Annotated[
    tuple[Text, ...],
    BeforeValidator(_as_list, json_schema_input_type=str | list[str]),
    Field(strict=False),
]
"""One name or a list of names, which may be empty."""

Factors = Annotated[
    tuple[float, ...],
    BeforeValidator(_as_list, json_schema_input_type=float | list[float]),
    Field(min_length=1, strict=False),
]
"""One number or a list of numbers to be multiplied."""


class Table(BaseModel):
    """One table of a case file."""

    model_config = ConfigDict(defer_build=True, strict=True, extra="forbid", frozen=True, allow_inf_nan=False)

    @model_validator(mode="before")
    @classmethod
    def _refuse_unknown_keys(cls, raw: Any) -> Any:
        for key in raw if isinstance(raw, Mapping) else ():
            if key not in cls.model_fields:
                raise PydanticCustomError(
                    "unknown_key",
                    "{hint}",
                    {"key": str(key), "hint": f"is not a known key{suggest(key, cls.model_fields)}"},
                )
        return raw


def nearest(word: str, valid: Iterable[str]) -> str | None:
    """Return the valid word that a misspelt one most likely meant, or ``None``."""
    folded = {name.casefold(): name for name in valid}
    found = difflib.get_close_matches(str(word).casefold(), folded, n=1, cutoff=0.5)
    return folded[found[0]] if found else None


def suggest(word: str, valid: Iterable[str]) -> str:
    """Return the tail of a sentence about a wrong word: the nearest valid one, or the list of them."""
    valid = list(valid)
    if not valid:
        return "; there are none here"
    close = nearest(word, valid)
    return f"; did you mean '{close}'?" if close else f"; known here: {', '.join(sorted(valid))}"
