"""The exported routine gives what the kernel gives, called from C, in any state, and says what it cannot do."""

import subprocess
from pathlib import Path

import numpy as np
import pytest

import umat
from tests.umat.compiled import compiled
from umat import mandel, status
from umat.abaqus import strain_out, stress_in, stress_out, tangent_in
from umat.chang_hicher import ChangHicher
from umat.directions import Directions, directions, mirrored
from umat.export import export_umat, layout_of
from umat.external import External
from umat.lanes import COMPILED
from umat.mandel import from_tensor
from umat.sands import toyoura

pytestmark = pytest.mark.skipif(not COMPILED, reason="machine code needs numba's compiler")
RULE = directions("bazant_oh_21")
SANDS = {"total": toyoura(), "rate": toyoura()._replace(localisation="rate")}
PROPERTIES = (0.8, 0.2, 30.0, 40.0)
N = 24


def deposit(vertical: int) -> np.ndarray:
    """F of `PROPERTIES` about the axis `vertical`, written with rotations of the axis."""
    across = [0, 3 - vertical]
    axis, dip = np.zeros(3), np.radians(PROPERTIES[2:])
    axis[vertical] = np.cos(dip[0])
    axis[across] = np.sin(dip[0]) * np.array([np.cos(dip[1]), np.sin(dip[1])])
    return PROPERTIES[1] / 6.0**0.5 * from_tensor(3.0 * np.outer(axis, axis) - np.eye(3))


@pytest.fixture(scope="module", params=SANDS)
def exported(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory):
    """A sand and a record of its library."""
    sand = SANDS[request.param]
    library = tmp_path_factory.mktemp("exported") / "libch.so"
    try:
        layout = export_umat(sand, RULE, library)
    except ValueError as error:
        if "no linker was found" not in str(error):
            raise
        pytest.skip(str(error))
    return sand, External(str(library), PROPERTIES, layout.state_variables, thread_safe=True)


def starting(sand: ChangHicher, routine: External, stress: np.ndarray):
    vertical = 1 if routine.components == 4 else 2
    ours = umat.initial_state(sand, RULE, stress, void_ratio=PROPERTIES[0], fabric=deposit(vertical))
    return ours, umat.initial_state(routine, None, stress)


def same(left: np.ndarray, right: np.ndarray, size: float) -> None:
    np.testing.assert_allclose(left, right, rtol=0.0, atol=1e-12 * size)


def test_first_call_starts_as_our_own_state(exported) -> None:
    sand, routine = exported
    random = np.random.default_rng(0)
    stress = np.tile([100.0, 80.0, 120.0, 0, 0, 0], (N, 1)) + 5.0 * random.normal(size=(N, 6))
    ours, theirs = starting(sand, routine, stress)
    response = umat.update(routine, None, np.zeros((N, 6)), theirs)
    assert (response.status == status.OK).all()
    variables = response.state.variables
    assert (variables[:, 0] == 1.0).all()
    same(variables[:, 1], ours.void_ratio, 1.0)
    same(variables[:, [3, 4, 5, 8, 7, 6]] * mandel.FACTOR, ours.fabric, 1.0)
    same(variables[:, 11 : 11 + len(RULE)], ours.slip, np.abs(ours.slip).max())
    forces = variables[:, 11 + len(RULE) :].reshape(N, -1, 3)
    same(forces, ours.force, np.abs(ours.force).max(initial=1.0))


@pytest.mark.parametrize("components", [6, 4])
def test_paths_agree(exported, components: int) -> None:
    """Random increments of norms from 1e-5 to 3e-3, one after another: stress, tangent, state, refusals."""
    sand, routine = exported
    routine = routine._replace(components=components)
    random = np.random.default_rng(1)
    ours, theirs = starting(sand, routine, np.tile([100.0, 100.0, 100.0, 0, 0, 0], (N, 1)))
    for _ in range(8):
        strain = random.normal(size=(N, 6)) * 10.0 ** random.uniform(-5.0, -2.5, (N, 1))
        strain[:, 3:5] *= components == 6
        a, b = umat.update(sand, RULE, strain, ours), umat.update(routine, None, strain, theirs)
        good = a.status == status.OK
        np.testing.assert_array_equal(b.status == status.OK, good)
        known = np.arange(6) if components == 6 else np.array([0, 1, 2, 5])
        same(b.stress[good][:, known], a.stress[good][:, known], np.abs(a.stress).max())
        if components == 4:  # out of the plane the bedding makes shear stresses, which STATEV keeps
            shears = -b.state.variables[good, 9:11] * mandel.FACTOR[[4, 3]]
            same(shears, a.stress[good][:, [4, 3]], np.abs(a.stress).max())
        places = np.ix_(good, known, known)
        same(b.tangent[places], a.tangent[places], np.abs(a.tangent).max())
        same(b.state.variables[good, 1], a.state.void_ratio[good], 1.0)
        same(b.state.variables[good, 2], a.state.gap[good], 1.0)
        ours, theirs = a.state, b.state
    assert good.any()


def test_a_program_in_c_gets_the_same(exported, tmp_path: Path) -> None:
    """Twelve increments of a tilted deposit to 3 % shear, called from C: PNEWDT, STRESS, DDSDDE and STATEV."""
    sand, routine = exported
    driver = Path(compiled("driver.c", tmp_path, "-ldl", shared=False))
    strain = 2.5e-3 * np.tile([-0.4, -0.5, 1.0, 0.3, -0.2, 0.4], (12, 1)) * np.linspace(0.1, 1.9, 12)[:, None]
    stress = np.array([[100.0, 100.0, 100.0, 0, 0, 0]])
    words = [len(PROPERTIES), *PROPERTIES, *stress_out(stress)[0], *strain_out(strain).ravel()]
    done = subprocess.run(
        [driver, routine.library, "6", str(routine.state_variables), str(len(strain))],
        input=" ".join(float(word).hex() for word in words), capture_output=True, text=True, check=True,
    )  # fmt: skip
    rows = [[float.fromhex(word) for word in line.split()] for line in done.stdout.splitlines()]
    state, _ = starting(sand, routine, stress)
    for row, increment in zip(np.array(rows), strain, strict=True):
        response = umat.update(sand, RULE, increment[None], state)
        assert row[0] == 1.0
        assert response.status[0] == status.OK
        same(stress_in(row[1:7]), response.stress[0], np.abs(response.stress).max())
        same(tangent_in(row[7:43].reshape(6, 6)), response.tangent[0], np.abs(response.tangent).max())
        slip = row[43 + 11 : 43 + 11 + len(RULE)]
        same(slip, response.state.slip[0], np.abs(response.state.slip).max())
        state = response.state


def test_a_refused_increment_is_cut_back_and_kept_old(exported) -> None:
    sand, routine = exported
    ours, theirs = starting(sand, routine, np.array([[100.0, 100.0, 100.0, 0, 0, 0]]))
    strain = np.array([[0.9, 0.0, 0.0, 0.0, 0.0, 0.0]])
    assert umat.update(sand, RULE, strain, ours).status[0] != status.OK
    response = umat.update(routine, None, strain, theirs)
    assert response.status[0] == status.CUT_BACK
    np.testing.assert_array_equal(response.stress, ours.stress)
    assert not response.state.variables.any()


def test_without_stress_the_packing_is_about_to_close(exported) -> None:
    sand, routine = exported
    theirs = umat.initial_state(routine, None, np.zeros((1, 6)))
    response = umat.update(routine, None, np.zeros((1, 6)), theirs)
    p = sand.open_pressure * sand.reference_pressure
    np.testing.assert_allclose(response.stress[0], p * (mandel.IDENTITY + 0.4 * deposit(2)), rtol=1e-9)


@pytest.mark.parametrize(
    ("changes", "stress"),
    [({"state_variables": 8}, 100.0), ({"properties": ()}, 100.0), ({"properties": (3.0,)}, 100.0), ({}, -50.0)],
)
def test_wrong_calls_are_told_by_nan(exported, changes: dict, stress: float) -> None:
    routine = exported[1]._replace(**changes)
    state = umat.initial_state(routine, None, np.array([[stress] * 3 + [0.0] * 3]))
    assert umat.update(routine, None, np.zeros((1, 6)), state).status[0] != status.OK


def test_threads_have_their_own_storage(exported) -> None:
    """1,000 points in slices of 256, several threads at once, against one thread."""
    routine = exported[1]
    stress = np.tile([100.0, 100.0, 100.0, 0, 0, 0], (1000, 1))
    strain = np.random.default_rng(2).normal(size=(1000, 6)) * 1e-4
    answers = []
    for material in (routine, routine._replace(thread_safe=False)):
        answers.append(umat.update(material, None, strain, umat.initial_state(material, None, stress)))
    np.testing.assert_array_equal(answers[0].stress, answers[1].stress)
    np.testing.assert_array_equal(answers[0].state.variables, answers[1].state.variables)


def test_mirrored_directions_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="half the sphere"):
        export_umat(toyoura(), mirrored(RULE), tmp_path / "libch.so")


def test_without_a_linker_one_sentence(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.delenv("CC", raising=False)
    with pytest.raises(ValueError, match="no linker was found"):
        export_umat(toyoura(), RULE, tmp_path / "libch.so")


@pytest.mark.parametrize("sand", SANDS.values(), ids=SANDS)
def test_layout_counts_what_the_state_holds(sand: ChangHicher) -> None:
    layout = layout_of(sand, RULE)
    assert layout.state_variables == 11 + len(RULE) * (4 if sand.localisation == "rate" else 1)
    assert isinstance(RULE, Directions)
    assert layout.lines()[-1].split()[1].endswith(str(layout.state_variables))
