"""Sweeps, studies and calibrations of small cases, from the file to the tables."""

import csv
import json
import os
import signal
import tomllib
from pathlib import Path

import numpy as np
import pytest

from fabfem.case import CaseError, case_from
from fabfem.cli import main
from fabfem.commands.status import BAD_INPUT, DONE, STOPPED
from fabfem.study.certainty import blind_spots, certainty
from fabfem.study.processes import Job, Limits, Pool, fits, limits
from fabfem.study.store import ASIDE, run_key
from fabfem.study.variants import Setting, variant
from fabfem.study.worker import Ran, Task

TUBE = """
[scene]
kind = "boundary_value"
kinematics = "axisymmetric"
[mesh]
box = { lower = [1.0, 0.0], upper = [2.0, 0.5], size = 0.5 }
points = 9
[material.tube]
model = "elastic"
youngs_modulus = 1.0
[[support]]
boundary = ["bottom", "top"]
fix = ["z"]
[[stage]]
name = "pressure"
kind = "load"
pressure = [{ boundary = "left", value = 1.0 }]
increments = { initial = 0.5, maximum = 0.5 }
[[probe]]
name = "u_a"
boundary = "left"
component = "r"
"""

SWEEP = """
[sweep]
workers = 2
columns = ["u_a"]
[[sweep.parameter]]
name = "E"
at = "material.tube.youngs_modulus"
values = [1.0, 2.0]
[[sweep.parameter]]
name = "pressure"
at = "stage[pressure].pressure[1].value"
values = [1.0, 3.0]
"""

STUDY = """
[study]
workers = 1
repeat = 1
quantity = { column = "u_a", take = "last" }
TRUTH
[[study.knob]]
name = "size"
at = "mesh.box.size"
values = [0.25, 0.125, 0.0625]
order = 4.0
[[study.knob]]
name = "increment"
at = ["stage[pressure].increments.initial", "stage[pressure].increments.maximum"]
values = [1.0, 0.25]
"""

CALIBRATION = """
[calibration]
workers = 2
data = "data.csv"
over = { data = "pressure", history = "time" }
curve = [{ data = "u", history = "u_a" }]
test = [{ where = { tube = "thick" } }]
tolerance = 1e-6
[[calibration.parameter]]
name = "E"
at = "material.tube.youngs_modulus"
start = 3.0
lower = 0.1
upper = 10.0
scale = "logarithmic"
"""


@pytest.fixture
def tube(tmp_path: Path) -> Path:
    return tmp_path / "tube.toml"


def table(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_a_sweep_runs_the_product_once(tube: Path, tmp_path: Path) -> None:
    tube.write_text(TUBE + SWEEP, encoding="utf-8")
    words = ["sweep", str(tube), "--out", str(tmp_path / "out"), "--quiet"]
    assert main(words) == DONE
    rows = table(tmp_path / "out" / "sweep.csv")
    assert [(row["E"], row["pressure"]) for row in rows] == [("1", "1"), ("1", "3"), ("2", "1"), ("2", "3")]
    found = [float(row["u_a [m]"]) for row in rows]
    np.testing.assert_allclose(np.array(found) / found[0], [1.0, 3.0, 0.5, 1.5], rtol=1e-9)
    kept = {path: path.stat().st_mtime_ns for path in tmp_path.glob("out/runs/*/history.csv")}
    assert main(words) == DONE
    assert {path: path.stat().st_mtime_ns for path in tmp_path.glob("out/runs/*/history.csv")} == kept
    tube.write_text(TUBE + SWEEP.replace("[1.0, 3.0]", "[1.0, 3.0, 4.0]"), encoding="utf-8")
    assert main(words) == DONE
    assert len(list(tmp_path.glob("out/runs/*"))) == 6
    assert all(path.stat().st_mtime_ns == before for path, before in kept.items())


def test_a_run_that_stops_has_its_row(tube: Path, tmp_path: Path) -> None:
    weak = TUBE.replace("points = 9", "").replace('"elastic"', '"von_mises"\nyield_stress = 1.0')
    tube.write_text(weak + SWEEP, encoding="utf-8")
    assert main(["sweep", str(tube), "--out", str(tmp_path / "out"), "--quiet"]) == STOPPED
    rows = table(tmp_path / "out" / "sweep.csv")
    assert {row["status"] for row in rows if row["pressure"] == "3"} == {"stopped"}
    assert all("stage pressure stopped at" in row["reason"] for row in rows if row["status"] == "stopped")


@pytest.mark.parametrize(
    ("said", "sentence"),
    [
        ("", "sweep: is missing"),
        (SWEEP.replace("[pressure].pressure", "[presure].pressure"), "no entry 'presure'; did you mean 'pressure'?"),
        (SWEEP.replace("[1.0, 2.0]", "[1.0, -2.0]"), "material.tube.youngs_modulus: must be greater than 0 (got -2.0)"),
        (SWEEP.replace('"u_a"', '"u_b"'), "sweep.columns: no history has a column 'u_b'"),
    ],
)
def test_a_bad_sweep_gets_a_sentence(
    said: str, sentence: str, tube: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    tube.write_text(TUBE + said, encoding="utf-8")
    assert main(["sweep", str(tube), "--out", str(tmp_path / "out"), "--quiet"]) == BAD_INPUT
    assert sentence in capsys.readouterr().err


@pytest.mark.parametrize("truth", ["truth = { exact = 1.9066666666666667 }", 'truth = { richardson = "size" }', ""])
@pytest.mark.parametrize("turn", ["one_at_a_time", "product"])
def test_a_study_tells_error_and_order(truth: str, turn: str, tube: Path, tmp_path: Path) -> None:
    tube.write_text(TUBE + STUDY.replace("TRUTH", f'{truth}\nturn = "{turn}"'), encoding="utf-8")
    assert main(["study", str(tube), "--out", str(tmp_path / "out"), "--quiet"]) == DONE
    rows = table(tmp_path / "out" / "study.csv")
    found = json.loads((tmp_path / "out" / "study.json").read_text(encoding="utf-8"))
    assert found["truth"]["value"][0] == pytest.approx(1.9066666667, rel=1e-6)
    errors = {row["size"]: float(row["error"]) for row in rows if row["increment"] in ("", "0.25")}
    assert errors["0.25"] > errors["0.125"] > errors["0.0625"]
    (order,) = found["orders"]
    assert order["by_differences"] == pytest.approx(4.0, abs=0.2)
    if truth:
        assert order["observed"] == pytest.approx(4.0, abs=0.2)
    assert any(row["pareto"] == "1" for row in rows)
    assert "The error of the size dominates." in found["sentences"][-1]
    assert (tmp_path / "out" / "study.png").is_file()


def test_a_run_says_the_error_class_that_the_study_of_its_case_found(
    tube: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text, out = TUBE + STUDY.replace("TRUTH", "truth = { exact = 1.9066666666666667 }"), str(tmp_path / "out")
    tube.write_text(text, encoding="utf-8")
    assert main(["solve", str(tube), "--out", out]) == DONE
    assert "\n  error" not in capsys.readouterr().out
    assert main(["study", str(tube), "--out", str(tmp_path / "study"), "--keep", "--quiet"]) == DONE
    (own,) = [row for row in table(tmp_path / "study" / "study.csv") if not row["size"] and not row["increment"]]
    assert 5e-4 < float(own["error"]) < 1e-3
    assert main(["solve", str(tube), "--out", out]) == DONE
    assert (
        "\n  error     up to 0.1 % of u_a (its study: 0.083 %; size 0.083 %, increment 0 %); size 0.0625: "
        in capsys.readouterr().out
    )
    tube.write_text(text.replace("size = 0.5", "size = 0.25"), encoding="utf-8")
    assert main(["solve", str(tube), "--out", out]) == DONE
    assert "\n  error     not known: the study kept beside the case was made when mesh" in capsys.readouterr().out
    tube.with_suffix(".study.json").write_text("{", encoding="utf-8")
    assert main(["solve", str(tube), "--out", out]) == DONE
    assert "\n  error" not in capsys.readouterr().out


def test_a_calibration_finds_what_made_the_data(tube: Path, tmp_path: Path) -> None:
    tube.write_text(TUBE + CALIBRATION, encoding="utf-8")
    lines = ["# made with E = 0.8", "tube,pressure,u"]
    exact = 1.9066666666666667 / 0.8
    lines += [f"thick,{part},{part * exact}" for part in (0.5, 1.0)]
    lines += [f"other,{part},5.0" for part in (0.5, 1.0)]
    (tmp_path / "data.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    assert main(["calibrate", str(tube), "--out", str(tmp_path / "out"), "--quiet"]) == DONE
    found = json.loads((tmp_path / "out" / "calibration.json").read_text(encoding="utf-8"))
    assert found["parameters"]["E"] == pytest.approx(0.8, rel=2e-3)  # the mesh is coarse
    assert found["rms"]["all"]["u"] < 1e-3 < found["rms_at_start"]["all"]["u"]
    assert (tmp_path / "out" / "calibration.png").is_file()


def test_what_the_data_cannot_see_is_said() -> None:
    rng = np.random.default_rng(1)
    seen, twin = rng.normal(size=40), rng.normal(size=40)
    near = twin + 0.01 * rng.normal(size=40)
    jacobian = np.stack([seen, twin, near, 1e-3 * rng.normal(size=40), np.zeros(40), seen], axis=1)
    residual = 0.01 * rng.normal(size=40)
    said = list(blind_spots(["a", "b", "c", "weak", "idle"], certainty(residual, jacobian[:, :5])))
    assert said[0] == "The data do not depend on idle."
    assert said[1].startswith("The data do not tell weak:")
    assert said[2].startswith("b and c can stand for each other")
    assert len(said) == 3
    assert list(blind_spots(["a", "b", "d"], certainty(residual, jacobian[:, [0, 1, 5]]))) == [
        "The data tell only a combination of a, d."
    ]


def test_the_covariance_is_that_of_many_noisy_fits() -> None:
    rng = np.random.default_rng(2)
    jacobian = rng.normal(size=(60, 2))
    noise = 0.1 * rng.normal(size=(4000, 60))
    fitted = noise @ np.linalg.pinv(jacobian).T
    residual = noise[0] - jacobian @ fitted[0]
    known = certainty(residual, jacobian)
    np.testing.assert_allclose(known.deviations, fitted.std(axis=0), rtol=0.3)
    np.testing.assert_allclose(known.correlation[0, 1], np.corrcoef(fitted.T)[0, 1], atol=0.05)


def test_memory_holds_jobs_back_but_never_the_only_one() -> None:
    allowed = Limits(workers=3, threads=1, memory=1000.0)
    assert fits(5000.0, [], allowed)
    assert fits(400.0, [500.0], allowed)
    assert not fits(600.0, [500.0], allowed)
    assert not fits(1.0, [1.0, 1.0, 1.0], allowed)
    assert limits(3, 10.0)[::2] == (3, 10.0)


def test_a_killed_process_costs_its_run_alone(tmp_path: Path) -> None:
    tables = tomllib.loads(TUBE)
    jobs = [Job(Task(tables, tmp_path / "c.toml", tmp_path / str(n))) for n in range(3)]
    jobs[0] = Job(Task({"scene": _Deadly()}, tmp_path / "c.toml", tmp_path / "0"))
    with Pool(Limits(1, 1, 1e9)) as pool:
        found: dict[int, Ran] = dict(pool.run(jobs))
    assert found[0].status == "killed"
    assert "signal 9" in found[0].reason
    assert [found[n].status for n in (1, 2)] == ["completed", "completed"]


class _Deadly:
    """What kills the process that unpacks it."""

    def __reduce__(self) -> tuple[object, ...]:
        return (_kill, ())


def _kill() -> None:
    os.kill(os.getpid(), signal.SIGKILL)


def test_the_key_of_a_run_knows_all_that_decides_it(tmp_path: Path) -> None:
    tables, path = tomllib.loads(TUBE), tmp_path / "c.toml"
    key = run_key(case_from(tables, path))
    assert run_key(case_from(variant(tables, [Setting("", ("mesh.order",), 2)]), path)) == key
    assert run_key(case_from(variant(tables, [Setting("", ("mesh.order",), 1)]), path)) != key
    with_file = variant(tables, [Setting("", ("mesh",), {"file": "m.inp"})])
    (tmp_path / "m.inp").write_text("a", encoding="utf-8")
    before = run_key(case_from(with_file, path))
    (tmp_path / "m.inp").write_text("b", encoding="utf-8")
    assert run_key(case_from(with_file, path)) != before


@pytest.mark.parametrize(
    ("said", "sentence"),
    [
        (STUDY.replace("TRUTH", 'truth = { richardson = "siz" }'), "there is no knob 'siz'; did you mean 'size'?"),
        (STUDY.replace("TRUTH", "truth = { exact = 1.0, richardson = 'size' }"), "needs one of exact, richardson"),
        (STUDY.replace("TRUTH", "").replace('"last"', '"at"'), "take = 'at' and 'at' need each other"),
        (STUDY.replace("TRUTH", "").replace('"u_a"', '"u_b"'), "study.truth: the finest run does not have"),
        (CALIBRATION, "data.csv cannot be read"),
        (CALIBRATION.replace("start = 3.0", "start = 30.0"), "must satisfy lower < start < upper"),
    ],
)
def test_a_bad_study_or_calibration_gets_a_sentence(said: str, sentence: str, tube: Path, tmp_path: Path) -> None:
    from fabfem.study.calibrate import calibrate
    from fabfem.study.work_precision import study

    tube.write_text(TUBE + said, encoding="utf-8")
    with pytest.raises(CaseError) as caught:
        (calibrate if "[calibration]" in said else study)(tube, tmp_path / "out", quiet=True)
    assert sentence in str(caught.value)


def test_every_source_that_decides_no_result_is_there() -> None:
    package = Path(__file__).parents[3] / "fabfem"
    assert [name for name in ASIDE if not (package / name).exists()] == []
