"""What a case may say, and the strict reader of its TOML file.

A case is a tree of frozen tables with all defaults filled in. Nothing here knows a mesh, a material or a solver:
names that only those can vouch for are checked when the problem is built, with the same kind of sentence.

The tables of a kind of scene are loaded when they are first asked for: those of all kinds take a tenth of a second.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from fabfem.case.reader import case_from, read_case, read_tables, resolved
from fabfem.case.schema import Case
from fabfem.case.sentences import CaseError
from fabfem.case.table import nearest, suggest

if TYPE_CHECKING:
    from fabfem.case.boundary_value import BoundaryValueCase
    from fabfem.case.element import ElementCase
    from fabfem.case.fabric import FabricCase
    from fabfem.case.names import boundaries_of, zones_named

__all__ = [
    "BoundaryValueCase",
    "Case",
    "CaseError",
    "ElementCase",
    "FabricCase",
    "boundaries_of",
    "case_from",
    "nearest",
    "read_case",
    "read_tables",
    "resolved",
    "suggest",
    "zones_named",
]

_LATER = {"BoundaryValueCase": "boundary_value", "ElementCase": "element", "FabricCase": "fabric"}
_LATER |= {"boundaries_of": "names", "zones_named": "names"}


def __getattr__(name: str) -> Any:
    if name not in _LATER:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_LATER[name]}"), name)
