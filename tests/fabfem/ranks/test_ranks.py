"""A scene that several processes share: the same history as alone, one series of fields, one reason where it fails.

The runs are those of `scenes.py`, all of them in one call of ``mpiexec``. Without an installation of MPI, PETSc and
their Python packages what needs them is passed over, and the report says so.
"""

import csv
import json
import os
import re
import shutil
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scenes import SCENES

from fabfem.parallel.forcing import LEAST, MOST, forcing

HERE = Path(__file__).parent
MISSING = [name for name in ("mpi4py", "petsc4py") if not find_spec(name)]
MISSING += [] if shutil.which("mpiexec") else ["mpiexec"]
needs_mpi = pytest.mark.skipif(bool(MISSING), reason=f"no shared runs: {', '.join(MISSING)} is not installed")
CALM = {
    **{"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1", "OMPI_MCA_mpi_yield_when_idle": "1"},
    **{"OMPI_MCA_rmaps_base_oversubscribe": "1", "OMPI_MCA_hwloc_base_binding_policy": "none"},
}
"""Lets Open MPI start more processes than there are cores, as root in a container too."""
EXACT = [name for name in SCENES if name not in ("multigrid", "held", "options", "split", "ill")]


def started(ranks: int, *words: str | Path) -> subprocess.CompletedProcess[str]:
    """Run a program of Python in some processes of MPI, or in one without it."""
    launcher = ["mpiexec", "-n", str(ranks)] if ranks else []
    home = {"PYTHONPATH": str(HERE.parents[2])}
    command = [*launcher, sys.executable, *map(str, words)]
    return subprocess.run(command, env=os.environ | CALM | home, capture_output=True, text=True, check=False)


def ran(home: Path, ranks: int, names: list[str], *more: str) -> subprocess.CompletedProcess[str]:
    """Run some scenes into a folder."""
    home.mkdir(exist_ok=True)
    for name in names:
        (home / f"{name}.toml").write_text(SCENES[name], encoding="utf-8")
    return started(ranks, HERE / "scenes.py", home, *names, *more)


def table(folder: Path) -> tuple[list[str], list[str], np.ndarray]:
    """Return header, stages and numbers of a history."""
    with (folder / "history.csv").open(encoding="utf-8") as file:
        header, *rows = csv.reader(file)
    return header[1:], [row[0] for row in rows], np.array([row[1:] for row in rows], float)


def apart(one: Path, other: Path) -> dict[str, float]:
    """Return how far two histories are apart by column, over the largest value of the columns with its unit."""
    (header, stages, a), (again, others, b) = table(one), table(other)
    assert (header, stages) == (again, others)
    units = np.array([name.partition("[")[2] for name in header])
    sizes = [np.abs(a[:, units == unit]).max() for unit in units]
    return {name: float(np.abs(a - b)[:, k].max() / max(sizes[k], 1e-300)) for k, name in enumerate(header)}


@pytest.fixture(scope="module")
def alone(tmp_path_factory: pytest.TempPathFactory) -> Path:
    home = tmp_path_factory.mktemp("alone")
    done = ran(home, 0, EXACT)
    assert done.returncode == 0, done.stderr
    return home


@pytest.fixture(scope="module")
def shared(tmp_path_factory: pytest.TempPathFactory) -> Path:
    home = tmp_path_factory.mktemp("shared")
    done = ran(home, 2, list(SCENES))
    assert done.returncode == 0, done.stderr
    return home


@needs_mpi
@pytest.mark.parametrize("name", EXACT)
def test_two_ranks_write_the_history_of_one_process(name: str, alone: Path, shared: Path) -> None:
    assert len(table(alone / name)[2]) > 2
    assert max(apart(alone / name, shared / name).values()) < 1e-8


@needs_mpi
def test_three_ranks_write_it_too(alone: Path, tmp_path: Path) -> None:
    names = ["arc", "weak", "wet", "fails"]
    done = ran(tmp_path, 3, names)
    assert done.returncode == 0, done.stderr
    assert [name for name in names if max(apart(alone / name, tmp_path / name).values()) >= 1e-8] == []


def told(folder: Path) -> dict[str, Any]:
    """Return the report of a run."""
    return json.loads((folder / "report.json").read_text(encoding="utf-8"))


@needs_mpi
def test_the_scenes_go_the_ways_that_are_compared(shared: Path) -> None:
    """Stages, water that is shut in and then flows, an arc, a collapse, increments that are halved."""
    assert set(table(shared / "dry")[1]) == {"ground", "push"}
    header, stages, rows = table(shared / "wet")
    pressure = rows[:, header.index("pressure [kPa]")]
    assert pressure[stages.index("wait") - 1] == pytest.approx(20.0, rel=0.01), "water bears what is put on it"
    assert np.ptp(pressure[stages.index("wait") :]) > 0.05, "and goes where there is less of it"
    header, stages, rows = table(shared / "arc")
    steps = np.diff(rows[:4, header.index("load_factor [-]")], prepend=0.0)
    assert (steps > 0.0).all(), "pushed on"
    assert steps[3] < 0.1 * steps[0], "the arc is long where the load hardly rises"
    safety = told(shared / "weak")["factor_of_safety"]
    assert 0.0 < safety["first_failure"] - safety["last_equilibrium"] < 0.11
    assert told(shared / "wet")["cutbacks"]


@needs_mpi
def test_a_run_that_stops_does_so_at_the_same_place_with_the_same_reason(alone: Path, shared: Path) -> None:
    one, other = told(alone / "fails"), told(shared / "fails")
    assert (one["status"], len(one["cutbacks"]) > 1) == ("stopped", True)
    residual = re.compile(r"[\d.]+e[+-]\d+")  # of an iteration that goes nowhere
    assert residual.sub("", other["reason"]) == residual.sub("", one["reason"])
    kept = ("stage", "fraction", "size", "point")
    assert [[cut[key] for key in kept] for cut in other["cutbacks"]] == [
        [cut[key] for key in kept] for cut in one["cutbacks"]
    ]


@needs_mpi
@pytest.mark.parametrize(("name", "direct"), [("multigrid", "solid"), ("held", "body"), ("split", "wet")])
def test_multigrid_finds_what_the_direct_solver_finds(name: str, direct: str, alone: Path, shared: Path) -> None:
    found = {name: gap for name, gap in apart(alone / direct, shared / name).items() if not name.startswith("iter")}
    assert max(found.values()) < 1e-5
    ranks = json.loads((shared / name / "report.json").read_text(encoding="utf-8"))["ranks"]
    assert ranks["direct_instead"] == [0.0, 0.0]
    assert ranks["linear_iterations"][0] < 40 * ranks["solves"][0]


@needs_mpi
def test_an_iterative_solve_is_as_exact_as_newton_s_iteration_can_use(tmp_path: Path) -> None:
    """PETSc is handed tolerances that fall with the out-of-balance force, the same on both ranks."""
    (tmp_path / "multigrid.toml").write_text(SCENES["multigrid"], encoding="utf-8")
    (tmp_path / "program.py").write_text(FORCING, encoding="utf-8")
    done = started(2, tmp_path / "program.py", tmp_path / "multigrid.toml", tmp_path / "out", tmp_path)
    assert done.returncode == 0, done.stderr
    one, other = (np.loadtxt(tmp_path / f"handed{rank}") for rank in range(2))
    np.testing.assert_array_equal(one, other)
    size, handed, reached = one[one[:, 3] > 0.0, :3].T
    expected = [forcing(*pair) for pair in zip(size, [0.0, *size[:-1]], strict=True)]
    np.testing.assert_allclose(handed, 0.5 * np.array(expected))
    again = np.flatnonzero(one[:, 3] == 0.0)  # other right-hand sides with the same matrix
    np.testing.assert_array_equal(one[again, 1], one[again - 1, 1])
    assert (reached <= handed).all()
    fast = size[1:] < 0.04 * size[:-1]
    assert (handed[1:][fast] < 0.5 * MOST).all()
    assert (handed[1:][fast] < handed[:-1][fast]).sum() > 1, "in Newton's iterations of two increments at least"
    assert ((handed >= 0.5 * LEAST) & (handed <= 0.5 * MOST)).all()


FORCING = """
import sys
from pathlib import Path
import numpy as np
from mpi4py import MPI
from fabfem.cli import main
from fabfem.parallel.solver import PetscSolver

tried, factor, found, new = PetscSolver._tried, PetscSolver.factor, [], [True]
def watched(self, ksp, b, size):
    x, residual = tried(self, ksp, b, size)
    found.append((size, ksp.getTolerances()[0], residual, new[0]))
    new[0] = False
    return x, residual
def factored(self, matrix):
    new[0] = True
    factor(self, matrix)
PetscSolver._tried, PetscSolver.factor = watched, factored
status = main(["solve", sys.argv[1], "--out", sys.argv[2], "--quiet"])
np.savetxt(Path(sys.argv[3]) / f"handed{MPI.COMM_WORLD.rank}", found)
sys.exit(status)
"""
"""Writes down, solve by solve: norm of the right-hand side, tolerance handed to PETSc, residual, whether first."""


@needs_mpi
def test_several_ranks_find_the_condition_of_the_whole_matrix(shared: Path, tmp_path: Path) -> None:
    """From solves with MUMPS's factors and their transposes; the growth of its pivots MUMPS does not tell."""
    assert ran(tmp_path, 0, ["ill"]).returncode == 0
    (header, _, one), (other, _, two) = table(tmp_path / "ill"), table(shared / "ill")
    assert header[-2:] == ["condition_number [-]", "pivot_growth [-]"]
    assert other == header[:-1]
    assert one[:, -2].max() > 2.0 * one[0, -2], "clay that yields resists less"
    np.testing.assert_allclose(two[:, -1], one[:, -2], rtol=1e-6)


@needs_mpi
def test_options_of_petsc_go_before_the_program_s_and_mumps_stands_in(alone: Path, shared: Path) -> None:
    ranks = json.loads((shared / "options" / "report.json").read_text(encoding="utf-8"))["ranks"]
    assert ranks["direct_instead"][0] == ranks["solves"][0] > 2  # one iteration, as the case says, is never enough
    assert max(apart(alone / "solid", shared / "options").values()) < 1e-8


@needs_mpi
def test_progress_and_summary_come_from_the_first_rank_alone(tmp_path: Path) -> None:
    """What each rank says goes into files of its own, which pass for terminals, so that there is a bar."""
    (tmp_path / "dry.toml").write_text(SCENES["dry"], encoding="utf-8")
    (tmp_path / "program.py").write_text(SPOKEN, encoding="utf-8")
    done = started(2, tmp_path / "program.py", tmp_path / "dry.toml", tmp_path / "out", tmp_path)
    assert done.returncode == 0, done.stderr
    first, shown, second, silent = ((tmp_path / name).read_text("utf-8") for name in ("1.0", "2.0", "1.1", "2.1"))
    assert first.count("completed after 6 increments") == 1
    assert "increment 6" in shown
    assert second == silent == ""


SPOKEN = """
import os, sys
os.environ["FORCE_COLOR"] = "1"
sys.stderr.isatty = lambda: True
from mpi4py import MPI
for stream in (1, 2):
    name = os.path.join(sys.argv[3], f"{stream}.{MPI.COMM_WORLD.rank}")
    os.dup2(os.open(name, os.O_CREAT | os.O_WRONLY), stream)
from fabfem.cli import main
sys.exit(main(["solve", sys.argv[1], "--out", sys.argv[2]]))
"""
"""The command, its output by stream and rank."""


@needs_mpi
def test_the_report_tells_what_each_rank_had(shared: Path) -> None:
    ranks = json.loads((shared / "dry" / "report.json").read_text(encoding="utf-8"))["ranks"]
    assert sum(ranks["elements"]) == 24
    assert sum(ranks["unknowns"]) == 2 * 93
    assert max(ranks["points"]) < 24 * 4
    assert ranks["imbalance"]["elements"] < 1.2
    assert min(ranks["material"]) > 0.0


@needs_mpi
def test_the_field_of_the_error_does_not_show_where_the_mesh_is_divided(alone: Path, shared: Path) -> None:
    import pyvista

    whole, pieces = (pyvista.read(sorted((home / "sure").glob(name))[-1]) for home, name in (
        (alone, "fields_*.vtu"), (shared, "fields_*.pvtu")
    ))  # fmt: skip
    order = [pieces.find_closest_cell(place) for place in whole.cell_centers().points]
    one, other = (mesh.cell_data["discretisation_error"] for mesh in (whole, pieces))
    assert one.max() > 0.0
    np.testing.assert_allclose(other[order], one, rtol=1e-6)


@needs_mpi
def test_a_singular_matrix_does_not_spoil_the_solves_after_it(tmp_path: Path) -> None:
    (tmp_path / "dry.toml").write_text(SCENES["dry"], encoding="utf-8")
    program = tmp_path / "singular.py"
    program.write_text(PROGRAM, encoding="utf-8")
    done = started(2, program, tmp_path / "dry.toml")
    assert done.returncode == 0, done.stderr
    for rank in range(2):
        assert json.loads((tmp_path / f"found{rank}").read_text()) == [True, False, False, True]


PROGRAM = """
import json, sys
from pathlib import Path
import numpy as np
from fabfem.boundary_value.problem import build
from fabfem.case import case_from, read_tables
from fabfem.fem.points import elastic_tangents
from fabfem.fem.systems import systems_of

path = Path(sys.argv[1])
model = build(case_from(read_tables(path), path)).model
system = systems_of(model)[1]
tangent = elastic_tangents(model.space, model.zones, model.states)
whole = system.reduction.stiffness(tangent)
empty = whole.copy()
empty.data[:] = 0.0
solver = model.space.mesh.ranks.solver(system.constraints, system.space)
found = []
for matrix in (whole, empty, None, whole):
    if matrix is not None:
        solver.factor(matrix)
    found.append(solver.solve(np.ones(whole.shape[0])).ok)
path.with_name(f"found{model.space.mesh.ranks.rank}").write_text(json.dumps(found))
"""
"""Solves with a good matrix, twice with one of zeros, and with the good one again."""


@needs_mpi
def test_the_pieces_are_opened_as_one(alone: Path, shared: Path) -> None:
    import pyvista

    whole, pieces = (pyvista.get_reader(home / "dry" / "fields.pvd") for home in (alone, shared))
    assert whole.time_values == pieces.time_values
    for reader in (whole, pieces):
        reader.set_active_time_value(whole.time_values[-1])
    one, other = whole.read()[0], pieces.read()[0]
    assert one.n_cells == other.n_cells
    nearest = other.find_closest_point
    order = [nearest(point) for point in one.points]
    for name in ("displacement", "stress", "p"):
        np.testing.assert_allclose(other.point_data[name][order], one.point_data[name], rtol=1e-5, atol=1e-5)


@needs_mpi
@pytest.mark.parametrize(
    ("name", "first", "then"), [("dry", 2, 3), ("dry", 2, 0), ("dry", 0, 2), ("sure", 2, 3), ("sure", 0, 2)]
)
def test_a_checkpoint_of_some_ranks_is_read_by_others(
    name: str, first: int, then: int, alone: Path, shared: Path, tmp_path: Path
) -> None:
    shutil.copytree({0: alone, 2: shared}[first] / name, tmp_path / name)
    last = sorted((tmp_path / name).glob("checkpoint_*.npz"))[-1]
    last.unlink()
    kept = sorted((tmp_path / name).glob("checkpoint_*.npz"))
    assert kept, "there is nothing to go on from"
    report = tmp_path / name / "report.json"
    report.unlink()
    done = ran(tmp_path, then, [name], "--resume")
    assert done.returncode == 0, done.stderr
    assert max(apart(alone / name, tmp_path / name).values()) < 1e-8
    assert json.loads(report.read_text(encoding="utf-8"))["status"] == "completed"


@needs_mpi
def test_a_rank_that_fails_stops_all_with_its_reason(tmp_path: Path) -> None:
    program = tmp_path / "fails.py"
    program.write_text(
        "import sys; from pathlib import Path\n"
        "from mpi4py import MPI\n"
        "import fabfem.boundary_value.record as record\n"
        "kept = record.Recorder.add\n"
        "def add(self, increment):\n"
        "    if MPI.COMM_WORLD.rank == 1 and increment.number == 3:\n"
        "        raise OSError(28, 'No space left on device')\n"
        "    kept(self, increment)\n"
        "record.Recorder.add = add\n"
        "from fabfem.cli import main\n"
        "sys.exit(main(['solve', sys.argv[1], '--out', sys.argv[2], '--quiet']))\n",
        encoding="utf-8",
    )
    (tmp_path / "dry.toml").write_text(SCENES["dry"], encoding="utf-8")
    done = started(2, program, tmp_path / "dry.toml", tmp_path / "out")
    assert done.returncode != 0
    assert "rank 1 of 2" in done.stderr
    assert "No space left on device" in done.stderr
    assert [row[0] for row in table(tmp_path / "out")[2].tolist()][:2] == [1.0, 2.0]
    report = json.loads((tmp_path / "out" / "report.json").read_text(encoding="utf-8"))
    assert (report["status"], "No space" in report["reason"]) == ("stopped", True)


@needs_mpi
@pytest.mark.parametrize(
    ("wrong", "right", "said"),
    [
        ('boundary = "top"', 'boundary = "topp"', "the mesh has no boundary 'topp'"),
        ("k0 = 0.6", "k0 = 0.6\n[solver]\nlinear = 'superlu'", "is a solver of one process"),
        ('fix = ["x", "y"]', 'fix = ["x"]', "one rigid motion"),
    ],
)
def test_bad_input_is_said_once(wrong: str, right: str, said: str, tmp_path: Path) -> None:
    (tmp_path / "bad.toml").write_text(SCENES["dry"].replace(wrong, right), encoding="utf-8")
    done = started(2, "-m", "fabfem", "solve", tmp_path / "bad.toml", "--out", tmp_path / "out")
    assert done.returncode == 2
    (line,) = [line for line in done.stderr.splitlines() if line.startswith("fabfem:")]
    assert "bad.toml" in line
    assert said in line


@needs_mpi
@pytest.mark.parametrize(("name", "cells"), [("dry", "2, 1"), ("patches", "1, 1")])
def test_ranks_beyond_the_parts_of_a_mesh_have_nothing_to_do(name: str, cells: str, tmp_path: Path) -> None:
    case = tmp_path / "few.toml"
    case.write_text(re.sub(r"cells = \[[\d, ]+\]", f"cells = [{cells}]", SCENES[name]), encoding="utf-8")
    for ranks in (0, 3):
        done = started(ranks, "-m", "fabfem", "solve", case, "--out", tmp_path / str(ranks), "--quiet")
        assert done.returncode == 0, done.stderr
    assert max(apart(tmp_path / "0", tmp_path / "3").values()) < 1e-8
    assert len(told(tmp_path / "3")["ranks"]["elements"]) < 3
    bad = tmp_path / "bad.toml"
    bad.write_text(case.read_text(encoding="utf-8").replace('boundary = "top"', 'boundary = "topp"'), encoding="utf-8")
    done = started(3, "-m", "fabfem", "solve", bad, "--out", tmp_path / "out")
    assert done.returncode == 2
    (line,) = [line for line in done.stderr.splitlines() if line.startswith("fabfem:")]
    assert "topp" in line


@pytest.mark.parametrize(
    ("size", "last", "wanted"),
    [(1.0, 0.0, MOST), (5.0, 1.0, MOST), (0.03, 1.0, 4.5e-4), (2e-3, 1.0, 2e-6), (1e-9, 1.0, LEAST), (0.0, 1.0, LEAST)],
)
def test_the_forcing_term_is_the_square_of_what_was_left_within_bounds(size: float, last: float, wanted: float) -> None:
    assert (LEAST, MOST) == (1e-8, 1e-3)
    for scale in (1.0, 1e6):
        assert forcing(scale * size, scale * last) == pytest.approx(wanted)


@pytest.mark.skipif(not MISSING, reason="what it needs is installed")
def test_what_is_missing_is_said(tmp_path: Path) -> None:
    (tmp_path / "solid.toml").write_text(SCENES["multigrid"].replace("multigrid", "mumps"), encoding="utf-8")
    done = started(0, "-m", "fabfem", "solve", tmp_path / "solid.toml", "--out", tmp_path / "out")
    assert done.returncode == 2
    assert "fabfem[mpi]" in done.stderr


def test_a_run_of_one_process_imports_nothing_of_mpi(tmp_path: Path) -> None:
    (tmp_path / "dry.toml").write_text(SCENES["dry"], encoding="utf-8")
    code = "import sys; from fabfem.cli import main; main(sys.argv[1:]); print(sorted(sys.modules))"
    done = started(0, "-c", code, "solve", tmp_path / "dry.toml", "--out", tmp_path / "out", "--quiet")
    assert "fabfem.fem.ranks" in done.stdout
    assert not [name for name in ("mpi4py", "petsc4py", "fabfem.parallel.rank") if f"'{name}'" in done.stdout]
