"""What a search for the factor of safety leaves: the report's entry and the curve of displacement against factor."""

from pathlib import Path
from typing import Any

from fabfem.fem.increment import Collapsed
from fabfem.output.history import History


def safety(end: Collapsed) -> dict[str, Any]:
    """Return the report's entry on the factor of safety."""
    kept = ("stage", "last_equilibrium", "first_failure", "verdict", "reason")
    return {name: getattr(end, name) for name in kept} | {"tried": [factor._asdict() for factor in end.tried]}


def sentence(end: Collapsed) -> str:
    """Return the factor of safety as the terminal shows it."""
    if end.last_equilibrium is None:
        return f"factor of safety: below {end.first_failure:.4g}, {end.reason}"
    if end.first_failure is None:
        return f"factor of safety: {end.reason}"
    return f"factor of safety between {end.last_equilibrium:.4g} and {end.first_failure:.4g}: {end.reason}"


def write_curve(path: Path, end: Collapsed, length: str) -> None:
    """Write the largest displacement at each factor that was tried, in the order of the factors."""
    table = History(path, ["factor [-]", f"displacement [{length}]", "out_of_balance [-]", "verdict"])
    for factor in sorted(end.tried, key=lambda tried: tried.factor):
        table.write((factor.factor, factor.displacement, factor.out_of_balance, factor.verdict))
    table.close()
