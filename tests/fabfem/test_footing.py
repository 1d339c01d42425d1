"""The strip footing of the comparison settles as in five other programs (`tests/benchmarks/footing.py`)."""

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import pytest

SCRIPT = Path(__file__).parents[1] / "benchmarks" / "footing.py"


@pytest.fixture(scope="module")
def footing() -> ModuleType:
    """The benchmark as a module."""
    spec = importlib.util.spec_from_file_location("footing", SCRIPT)
    assert spec is not None
    assert spec.loader is not None
    module = sys.modules["footing"] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("solver", ["auto", "superlu"])
def test_settlement_is_that_of_other_programs(footing: ModuleType, solver: str) -> None:
    ran = footing.solve(footing.SIZES["5k"], "von_mises", solver)
    assert ran.end == ""
    assert ran.dofs == 5254
    assert ran.settlement == pytest.approx(footing.EXACT["5k"], rel=2e-6)  # seven digits are known
    assert ran.iterations <= 37
    assert 0 < ran.factorisations <= ran.iterations
