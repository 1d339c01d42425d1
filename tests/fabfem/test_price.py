"""The price of a run before it runs."""

import json
from pathlib import Path

import pytest

from fabfem.boundary_value.price import expected, measured, predicted, price, remember, stored
from fabfem.boundary_value.problem import build
from fabfem.case import BoundaryValueCase, read_case
from fabfem.cli import main
from fabfem.commands.status import DONE


@pytest.fixture
def case(folder: Path, monkeypatch: pytest.MonkeyPatch) -> BoundaryValueCase:
    """The small footing, and a cache of its own for the rates."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(folder / "cache"))
    found = read_case(folder / "case.toml")
    assert isinstance(found, BoundaryValueCase)
    return found


def test_the_increments_that_stages_promise(case: BoundaryValueCase) -> None:
    assert expected(case) == 1 + 4


def test_a_run_is_priced_at_what_it_took(case: BoundaryValueCase) -> None:
    problem = build(case)
    spent = {"material": 3.0, "assembly": 1.0, "linear_solve": 2.0, "output": 0.5, "mesh": 0.25, "total": 7.0}
    rates = measured(problem, spent, [5, 4, 6, 2, 9, 4], share=1.0)
    assert predicted(problem, rates) == pytest.approx(7.0)
    assert rates.increments == pytest.approx(6 / 5)
    assert rates.fixed == pytest.approx(0.5)


def test_a_finer_mesh_and_smaller_increments_cost_more(case: BoundaryValueCase) -> None:
    problem = build(case)
    spent = {"material": 3.0, "assembly": 1.0, "linear_solve": 2.0, "total": 6.0}
    rates = measured(problem, spent, [4] * 5, share=1.0)
    stage = case.stage[1]
    sizes = stage.increments.model_copy(update={"initial": 0.125, "maximum": 0.125})
    finer = case.model_copy(update={"stage": (case.stage[0], stage.model_copy(update={"increments": sizes}))})
    finer._path = case.path
    assert predicted(build(finer), rates) == pytest.approx(6.0 * 9 / 5)
    assert stored(case) is None


def test_rates_are_measured_at_first_use_and_bettered_by_a_run(
    case: BoundaryValueCase, capsys: pytest.CaptureFixture[str]
) -> None:
    first = price(build(case))
    assert first.seconds > 0.0
    assert "first increments" in first.source
    folder = case.path.parent / "out"
    assert main(["solve", str(case.path), "--out", str(folder), "--quiet"]) == DONE
    again = price(build(case))
    assert "a run of this kind" in again.source
    report = json.loads((folder / "report.json").read_text(encoding="utf-8"))
    assert again.seconds == pytest.approx(report["wall_time"]["total"], rel=0.01)
    assert main(["check", str(case.path), "--price"]) == DONE
    assert "judged by a run of this kind" in capsys.readouterr().out


def test_a_cache_that_cannot_be_written_or_read_is_no_trouble(case: BoundaryValueCase, folder: Path) -> None:
    (folder / "cache").write_text("", encoding="utf-8")
    remember(build(case), {"wall_time": {"linear_solve": 1.0, "total": 2.0}, "increments": [{"iterations": 1}]})
    assert stored(case) is None
