"""The price of a run before it runs."""

import json
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from fabfem.boundary_value.price import expected, measured, predicted, price, remember, stored
from fabfem.boundary_value.problem import build
from fabfem.case import BoundaryValueCase, ElementCase, FabricCase, read_case
from fabfem.cli import main
from fabfem.commands.status import DONE
from fabfem.fabric_tests import price as fabric
from fabfem.fabric_tests.drives import Block, Measured
from fabfem.fabric_tests.run import measure
from fabfem.laboratory import price as element
from fabfem.laboratory.specimen import Specimen
from fabfem.laboratory.specimen import build as build_specimen


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
    assert stored(case) is None
    assert main(["check", str(case.path)]) == DONE
    assert "not known before a run of this kind" in capsys.readouterr().out
    first = price(build(case))
    assert first.seconds > 0.0
    assert "first increments" in first.source
    folder = case.path.parent / "out"
    assert main(["solve", str(case.path), "--out", str(folder), "--quiet"]) == DONE
    again = price(build(case))
    assert "a run of this kind" in again.source
    report = json.loads((folder / "report.json").read_text(encoding="utf-8"))
    took = report["processor_time"]
    assert 0.0 < again.seconds - took["start"] <= 1.01 * report["wall_time"]["total"]
    assert again.seconds >= 0.9 * min(took["start"] + took["run"], report["wall_time"]["total"])
    assert main(["check", str(case.path)]) == DONE
    assert "judged by a run of this kind" in capsys.readouterr().out


def test_a_run_that_compiled_kernels_leaves_no_rates(
    case: BoundaryValueCase, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("fabfem.rates._kernels", iter(range(10**6)).__next__)  # more at every look
    assert main(["solve", str(case.path), "--out", str(case.path.parent / "out"), "--quiet"]) == DONE
    assert stored(case) is None
    assert main(["check", str(case.path)]) == DONE
    assert "not known before" in capsys.readouterr().out


def test_a_cache_that_cannot_be_written_or_read_is_no_trouble(case: BoundaryValueCase, folder: Path) -> None:
    (folder / "cache").write_text("", encoding="utf-8")
    remember(build(case), {"wall_time": {"linear_solve": 1.0, "total": 2.0}, "increments": [{"iterations": 1}]})
    assert stored(case) is None


ELEMENT = """
[scene]
kind = "element"

[material.clay]
model = "von_mises"
youngs_modulus = 1e4
poisson_ratio = 0.3
yield_stress = 50.0

[initial]
p = 100.0

[[stage]]
name = "shear"
kind = "triaxial"
drainage = "undrained"
axial_strain = [0.01, -0.01]
increments = 20
cycles = 3

[[stage]]
name = "probes"
kind = "probe"
of = "strain"
size = 1e-4
directions = 8
"""


@pytest.fixture
def specimen(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Specimen:
    """A test of metal, and a cache of its own for the rates."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    (tmp_path / "element.toml").write_text(ELEMENT, encoding="utf-8")
    return specimen_of(tmp_path / "element.toml")


def specimen_of(path: Path) -> Specimen:
    """The specimen of a case file."""
    case = read_case(path)
    assert isinstance(case, ElementCase)
    return build_specimen(case)


def test_the_rows_of_an_element_test(specimen: Specimen) -> None:
    assert element.legs(specimen) == [20] * 6 + [1] * 8


def test_an_element_test_is_priced_at_what_it_took(specimen: Specimen) -> None:
    rates = element.Rates(0.5, 10.0, 0.0, 0.25, 3.0, True)
    found = element.predicted(specimen, rates)
    assert found.evaluations == 10 * 128
    assert found.seconds == pytest.approx(3.0 + 0.5 * 1280 + 0.25 * 128)
    finer = element.predicted(specimen, rates._replace(steps=30.0))  # the curve needs more steps than rows
    assert finer.evaluations == 10 * 30 * 14


def test_rates_of_an_element_test_are_measured_and_bettered(
    specimen: Specimen, capsys: pytest.CaptureFixture[str]
) -> None:
    path = specimen.case.path
    first = element.price(specimen)
    assert "first rows" in first.source
    assert main(["solve", str(path), "--out", str(path.parent / "out"), "--quiet"]) == DONE
    again = element.price(specimen)
    assert "a run of this kind" in again.source
    report = json.loads((path.parent / "out" / "report.json").read_text(encoding="utf-8"))
    work = sum(stage.get("work", 0) for stage in report["stages"])
    assert again.evaluations == pytest.approx(work * 128 / 120, rel=0.05)
    assert first.evaluations == pytest.approx(again.evaluations, rel=1.0)
    longer = path.with_name("longer.toml")
    longer.write_text(ELEMENT.replace("cycles = 3", "cycles = 30"), encoding="utf-8")
    assert element.price(specimen_of(longer)).evaluations == pytest.approx(again.evaluations * 1208 / 128, rel=1e-6)
    assert main(["check", str(path)]) == DONE
    assert "judged by a run of this kind" in capsys.readouterr().out


FABRIC = """
[scene]
kind = "fabric"

[law.one]
law = "zhao_kruyt"

[law.other]
law = "yuan"

[surface]
angles = 41
"""


def test_a_case_on_fabric_laws_is_priced_by_its_curves(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    path = tmp_path / "surface.toml"
    path.write_text(FABRIC, encoding="utf-8")
    assert main(["check", str(path)]) == DONE
    assert "not known before a run of this kind" in capsys.readouterr().out
    assert main(["check", str(path), "--price"]) == DONE
    assert "judged by its first curves" in capsys.readouterr().out
    assert main(["solve", str(path), "--out", str(tmp_path / "out"), "--quiet"]) == DONE
    case = read_case(path)
    assert isinstance(case, FabricCase)
    known = fabric.stored(case)
    assert known is not None
    assert known.whole
    report = json.loads((tmp_path / "out" / "report.json").read_text(encoding="utf-8"))
    spent, took = report["wall_time"], report["processor_time"]
    assert sum(spent[phase] for phase in ("start", "curves", "output")) <= spent["total"]
    assert known.seconds == pytest.approx(took["start"] + min(took["run"], spent["total"]), rel=0.01)


def test_a_pilot_of_fabric_laws_takes_the_first_blocks_for_all(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setattr(fabric, "PILOT", 0.05)
    path = tmp_path / "surface.toml"
    path.write_text(FABRIC, encoding="utf-8")
    case = read_case(path)
    assert isinstance(case, FabricCase)
    done = []

    def blocks() -> Iterator[Block]:
        for number in range(1000):
            until = time.process_time() + 0.02
            while time.process_time() < until:
                pass
            done.append(number)
            yield Block([], {})

    start = time.process_time()
    found = fabric.price(case, lambda: Measured((), blocks(), 1000, ()))
    assert len(done) < 20
    assert 19.0 < found.seconds - start < 40.0
    assert fabric.price(case, lambda: measure(case.drive, case)) == found
