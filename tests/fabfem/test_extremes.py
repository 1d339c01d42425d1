"""What counts as an extreme that holds, and quick members of every group."""

import json
import math
from importlib.util import find_spec

import pytest

from fabfem.cli import main
from fabfem.commands.status import BAD_INPUT, DONE, RED
from fabfem.extremes import agreement, report, sand, stiff
from fabfem.extremes.refusals import BODIES, refusals
from fabfem.extremes.sweep import Found, sweep
from umat.lanes import COMPILED

#: answers at 1, 2, 3 -> whether green as a limit, as a resolution; where it broke
SWEEPS = {
    "all the same": ([Found(1.0, 1.0)] * 3, True, True, 3),
    "refused beyond": ([Found(1.0, 1.0), Found(1.0, 1.0), Found(None, 1.0, "why")], True, True, 2),
    "refused before": ([Found(1.0, 1.0), Found(None, 1.0, "why"), Found(1.0, 1.0)], False, False, 1),
    "wrong beyond": ([Found(1.0, 1.0), Found(1.0, 1.0), Found(1.2, 1.0)], False, True, 2),
    "wrong after a refusal": ([Found(1.0, 1.0), Found(1.0, 1.0), Found(math.nan, 1.0)], False, False, 2),
    "refused in silence": ([Found(1.0, 1.0), Found(1.0, 1.0), Found(None, 1.0)], False, False, 2),
}


@pytest.mark.parametrize(("found", "limit", "resolution", "broke"), SWEEPS.values(), ids=SWEEPS)
def test_an_extreme_is_green_that_holds_as_far_as_asked(
    found: list[Found], limit: bool, resolution: bool, broke: int
) -> None:
    for as_resolution, green in ((False, limit), (True, resolution)):
        made = sweep("what", "x", (1, 2, 3), lambda x: found[int(x) - 1], 0.1, 2, as_resolution)
        assert (made.green, made.broke) == (green, broke)


def test_what_is_raised_is_a_fault_or_a_refusal() -> None:
    def run(x: float) -> Found:
        raise (ValueError if x == 1 else ZeroDivisionError)("said")

    made = sweep("what", "x", (1, 2), run, 0.1, 1)
    assert [outcome.kind for outcome in made.outcomes] == ["refused", "fault"]
    assert not made.green


QUICK = {
    "contrast": (stiff.columns, 1e6, 1e-6),
    "flat elements": (stiff.flat, 1e2, 1e-6),
    "incompressible skeleton": (stiff.incompressible, 0.4999, 5e-3),
    "incompressible water": (stiff.water, 1e4, 1e-3),
    "units of a footing": (stiff.units, 1e3, 1e-10),
    "units of sand": (sand.units, 1e-3, 1e-10),
    "one increment": (sand.increments, 1.0, 0.02),
    "linear solvers": (agreement.solvers, 0.1, 1e-8),
    "threads": (agreement.threads, 2, 0.0),
}


@pytest.mark.skipif(not COMPILED, reason="takes the compiler")
@pytest.mark.parametrize(("run", "value", "tolerance"), QUICK.values(), ids=QUICK)
def test_mild_values_give_the_same_answer(run, value: float, tolerance: float) -> None:
    if run is agreement.solvers and find_spec("pypardiso") is None:
        pytest.skip("PARDISO is not installed")
    made = sweep("what", "x", (value,), run, tolerance, value)
    assert made.green, made.outcomes


def test_what_has_no_answer_is_refused_by_name() -> None:
    found = list(refusals())
    assert len(found) == len(BODIES)
    assert [row for row in found if not row.green] == []


def test_the_command_counts_what_is_red(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture) -> None:
    def fake(name: str):
        yield sweep("held", "x", (1, 2), lambda x: Found(1.0, 1.0), 0.1, 2)
        yield sweep("broke", "x", (1, 2), lambda x: Found(x, 1.0), 0.1, 1)

    monkeypatch.setattr(report, "run", fake)
    assert main(["stress", "--only", "stiff"]) == RED
    assert "2 rows: 1 green, 1 red" in capsys.readouterr().out
    assert main(["stress", "--only", "stiff", "--json"]) == RED
    said = json.loads(capsys.readouterr().out)
    assert [entry["verdict"] for entry in said] == ["green", "red"]
    assert main(["stress", "--only", "stif"]) == BAD_INPUT
    assert "did you mean 'stiff'" in capsys.readouterr().err


def test_the_command_runs() -> None:
    assert main(["stress", "--only", "refusals", "--quiet"]) == DONE
