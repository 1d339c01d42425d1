"""Boundary-value problems in granular soil with the fabric-enhanced Chang-Hicher model.

In Python: ``fabfem.solve(case)`` and ``fabfem.open_result(folder)`` give a `Result`; both are loaded when first used.
"""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fabfem.case import CaseError as CaseError
    from fabfem.case import read_case as read_case
    from fabfem.result import Result as Result
    from fabfem.result import open_result as open_result
    from fabfem.result import solve as solve

__version__ = "0.1.0"

_HOMES = {"fabfem.case": ("CaseError", "read_case"), "fabfem.result": ("Result", "open_result", "solve")}
"""Modules of what can be had from the package itself."""
__all__ = ["CaseError", "Result", "__version__", "open_result", "read_case", "solve"]


def __getattr__(name: str) -> Any:
    from importlib import import_module

    for home, names in _HOMES.items():
        if name in names:
            return getattr(import_module(home), name)
    raise AttributeError(f"module 'fabfem' has no attribute '{name}'")


def __dir__() -> list[str]:
    return sorted([*globals(), *__all__])
