"""Stress points of granular soils: materials, contact directions, element tests.

`umat` needs numpy and numba and stands alone.  Materials live in modules of their own,
imported when they are first asked for; see `docs/architecture.md` for the conventions.
"""

from importlib import import_module
from pathlib import Path
from typing import Any

from umat.cache import use_source_cache
from umat.interface import (
    Response,
    elastic_tangent,
    initial_state,
    state_fields,
    symmetric_tangent,
    update,
    weakened,
)
from umat.threads import set_threads

__all__ = [
    "ChangHicher",
    "Directions",
    "DruckerPrager",
    "Elastic",
    "External",
    "MohrCoulomb",
    "Response",
    "VonMises",
    "elastic_tangent",
    "initial_state",
    "set_threads",
    "state_fields",
    "symmetric_tangent",
    "update",
    "weakened",
]

_HOMES = {
    "ChangHicher": "chang_hicher",
    "Directions": "directions",
    "DruckerPrager": "drucker_prager",
    "Elastic": "elastic",
    "External": "external",
    "MohrCoulomb": "mohr_coulomb",
    "VonMises": "von_mises",
}

use_source_cache(Path(__file__).parent)


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'umat' has no attribute {name!r}")
    return getattr(import_module(f"umat.{_HOMES[name]}"), name)
