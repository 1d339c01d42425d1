"""The verification's quick rows are green, a wrong or missing answer is red, and the command says so."""

import json
from collections.abc import Iterator

import pytest

from fabfem.cli import main
from fabfem.commands.status import BAD_INPUT, DONE, RED
from fabfem.verification import bearing_capacity, circular_footing, convergence, cylinder, problems
from fabfem.verification.ground import Ground, footing
from fabfem.verification.report import cells
from fabfem.verification.row import Row
from fabfem.verification.scene import solve


@pytest.mark.parametrize("name", ["cook", "cylinder", "hill_tube", "mohr_coulomb_hole"])
def test_quick_problems_are_green(name: str) -> None:
    found = list(problems.rows(problems.PROBLEMS[name]))
    assert len(found) >= 3
    assert [row for row in found if not row.green] == []


@pytest.mark.parametrize(
    ("cell_type", "kinematics"),
    [
        ("triangle", "plane_strain"),
        ("triangle6", "axisymmetric"),
        ("quad", "axisymmetric_torsion"),
        ("tetra10", "solid"),
    ],
)
def test_errors_fall_at_the_order_of_the_element(cell_type: str, kinematics: str) -> None:
    u, strain = convergence.orders(cell_type, kinematics)
    assert (u.reference, strain.reference) == (convergence.degree(cell_type) + 1, convergence.degree(cell_type))
    assert u.green, u
    assert strain.green, strain


def test_footings_carry_what_they_must() -> None:
    found = [
        bearing_capacity.weightless(20, rough=False, surcharge=1.0),
        bearing_capacity.heavy(20, rough=False),
        circular_footing.capacity("quad8", rough=False),
    ]
    assert [row for row in found if not row.green] == []


def test_cylinder_locks_without_the_mean() -> None:
    """Ten bilinear elements across the wall lose two thirds of the movement to locking, and 1/1000 with the mean."""
    moved = {}
    for said in ("pointwise", "mean"):
        mesh = {"order": 1, "volume_strain": said}
        moved[said] = cylinder.cylinder(0.1, 0.2, 60.0, 2e5, cylinder.NEARLY, "quad", 10, mesh=mesh).final("inner")
    assert moved["pointwise"] == pytest.approx(2.0e-5, rel=0.01)
    assert moved["mean"] == pytest.approx(6e-5, rel=1e-3)


def test_a_run_that_stops_is_a_red_row_with_its_reason() -> None:
    clay = {"model": "von_mises", "youngs_modulus": 1e3, "poisson_ratio": 0.45, "yield_stress": 1.0}
    tables = footing(clay, 0.02, rough=True)
    tables["stage"] = [{"name": "push", "kind": "load", "traction": [{"boundary": "footing", "y": -9.0}]}]
    tables["stage"][0]["increments"] = {"initial": 0.25, "maximum": 0.25, "minimum": 0.1}
    tables["reaction"] = []
    answer = solve(tables, Ground(2.0, 1.0, 0.1).mesh("quad"))
    assert answer.final("load") is None
    assert answer.stopped.startswith("stage push stopped at ")
    row = Row("collapse", 5.0, answer.final("load"), 0.02, answer.seconds, answer.stopped)
    assert (row.green, row.error, cells(row)[2]) == (False, None, "-")


def test_a_red_row_is_an_exit_status(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture) -> None:
    def wrong(problem: problems.Problem) -> Iterator[Row]:
        yield Row("right", 2.0, 2.01, 0.01)
        yield Row("wrong", 2.0, 2.03, 0.01)

    monkeypatch.setattr("fabfem.verification.report.rows", wrong)
    assert main(["verify", "--only", "cook"]) == RED
    assert "2 rows: 1 green, 1 red" in capsys.readouterr().out
    assert main(["verify", "--only", "cook", "--json"]) == RED
    said = json.loads(capsys.readouterr().out)
    assert [entry["verdict"] for entry in said] == ["green", "red"]
    assert said[1]["error"] == pytest.approx(0.015)


def test_the_command_runs_what_it_is_told(capsys: pytest.CaptureFixture) -> None:
    assert main(["verify", "--only", "cook"]) == DONE
    shown = capsys.readouterr().out
    assert "hexahedron20" in shown
    assert "3 rows: 3 green, 0 red" in shown
    assert main(["verify", "--only", "cooks"]) == BAD_INPUT
    assert "did you mean 'cook'" in capsys.readouterr().err


def test_every_problem_has_a_module() -> None:
    assert {problem.module for problem in problems.PROBLEMS.values()} == set(problems.PROBLEMS)
