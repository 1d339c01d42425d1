"""Compiled UMATs written for these tests, in Fortran and C, against the materials of this package."""

from pathlib import Path

import numpy as np
import pytest

import umat
from tests.umat.compiled import compiled
from umat import abaqus, mandel, status
from umat.external import External

N = 200
STRESS = np.tile([100.0, 100.0, 100.0, 0.0, 0.0, 0.0], (N, 1))
ELASTIC, STIFFNESS = umat.Elastic(1e4, 0.3), (1e4, 0.3)
MOHR_COULOMB = {"with cohesion": (1e4, 0.3, 5.0, 30.0, 10.0), "steep, no dilation": (1e4, 0.2, 1.0, 35.0, 0.0)}


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory):
    folder = tmp_path_factory.mktemp("routines")
    return lambda name: compiled(name, folder)


def increments(components: int = 6) -> np.ndarray:
    """Strain increments that reach faces, edges and the apex."""
    random = np.random.default_rng(1)
    strain = random.normal(size=(N, 6)) * 3e-3
    strain[:, :3] += random.normal(size=(N, 1)) * 2e-3
    if components == 4:
        strain[:, 3:5] = 0.0
    return strain


def both(material: External, ours, strain: np.ndarray):
    """Return the responses of a routine and of our own material."""
    return [umat.update(each, None, strain, umat.initial_state(each, None, STRESS)) for each in (material, ours)]


def test_conversions_are_their_own_inverse_and_keep_the_work() -> None:
    random = np.random.default_rng(0)
    stress, strain, tangent = random.normal(size=(3, 6)), random.normal(size=(3, 6)), random.normal(size=(3, 6, 6))
    np.testing.assert_allclose(abaqus.stress_in(abaqus.stress_out(stress)), stress, rtol=1e-15)
    np.testing.assert_allclose(abaqus.strain_in(abaqus.strain_out(strain)), strain, rtol=1e-15)
    work = np.sum(abaqus.stress_out(stress) * abaqus.strain_out(strain), axis=1)
    np.testing.assert_allclose(work, mandel.dot(stress, strain), rtol=1e-14)
    mandel_stress = np.einsum("nij,nj->ni", tangent, strain)
    ddsdde = abaqus.tangent_in(np.swapaxes(tangent, 1, 2))
    np.testing.assert_allclose(
        np.einsum("nij,nj->ni", ddsdde, strain),
        abaqus.stress_in(np.einsum("nij,nj->ni", tangent, abaqus.strain_out(strain))), rtol=1e-13,
    )  # fmt: skip
    assert mandel_stress.shape == stress.shape


@pytest.mark.parametrize("component", range(6))
def test_components_are_where_abaqus_has_them(component: int) -> None:
    """γ = 0.2 and tension positive, written out by hand."""
    tensor = np.zeros((3, 3))
    i, j = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))[component]
    tensor[i, j] = tensor[j, i] = 0.1
    vector = mandel.from_tensor(tensor)
    expected = np.zeros(6)
    expected[component] = -0.1 if component < 3 else -0.2
    np.testing.assert_allclose(abaqus.strain_out(vector), expected, atol=1e-16)
    expected[component] = -0.1
    np.testing.assert_allclose(abaqus.stress_out(vector), expected, atol=1e-16)


@pytest.mark.parametrize("components", [6, 4])
def test_an_elastic_routine_in_fortran_answers_as_our_material(library, components: int) -> None:
    material = External(library("elastic.f"), STIFFNESS, 1, components=components)
    theirs, ours = both(material, ELASTIC, increments(components))
    np.testing.assert_allclose(theirs.stress, ours.stress, rtol=1e-12, atol=1e-11)
    np.testing.assert_allclose(theirs.tangent, ours.tangent, rtol=1e-12, atol=1e-8)
    assert (theirs.state.variables == 1.0).all()
    state = umat.initial_state(material, None, STRESS)
    np.testing.assert_allclose(umat.elastic_tangent(material, state), ours.tangent, rtol=1e-12, atol=1e-8)
    assert not state.variables.any(), "the old state was touched"


@pytest.mark.parametrize("components", [6, 4])
@pytest.mark.parametrize("parameters", MOHR_COULOMB.values(), ids=MOHR_COULOMB)
def test_a_mohr_coulomb_routine_in_c_answers_as_our_material(
    library, parameters: tuple[float, ...], components: int
) -> None:
    material = External(library("mohr_coulomb.c"), parameters, 1, components=components)
    theirs, ours = both(material, umat.MohrCoulomb(*parameters), increments(components))
    assert 0.1 * N < theirs.state.variables.sum() < 0.9 * N, "some points must yield, and some not"
    assert (theirs.status == status.OK).all()
    np.testing.assert_allclose(theirs.stress, ours.stress, rtol=1e-10, atol=1e-9)
    known = np.ix_(range(N), [0, 1, 2, 5], [0, 1, 2, 5]) if components == 4 else ...
    np.testing.assert_allclose(theirs.tangent[known], ours.tangent[known], rtol=1e-6, atol=1e-4)


def test_state_variables_strain_and_time_go_on(library) -> None:
    material = External(library("elastic.f"), STIFFNESS, 2, (3.0, 7.0), time_step=0.5)
    state, strain = umat.initial_state(material, None, STRESS), increments()
    for _ in range(3):
        state = umat.update(material, None, strain, state).state
    np.testing.assert_array_equal(state.variables, np.tile([6.0, 7.0], (N, 1)))
    np.testing.assert_allclose(state.strain, 3.0 * strain)
    assert (state.time == 1.5).all()
    assert list(umat.state_fields(material, state)) == ["sdv1", "sdv2"]


@pytest.mark.parametrize(("fault", "code"), [(6, status.CUT_BACK), (7, status.OUTSIDE_FAULT)])
def test_a_refusal_keeps_the_old_state(library, fault: float, code: int) -> None:
    material = External(library("faulty.c"), (fault,), 0)
    old = umat.initial_state(material, None, STRESS)
    response = umat.update(material, None, increments(), old)
    assert (response.status == code).all()
    for new, before in zip(response.state, old, strict=True):
        np.testing.assert_array_equal(new, before)


def test_without_ddsdde_differences_are_taken(library) -> None:
    responses = [
        umat.update(material, None, increments(), umat.initial_state(material, None, STRESS))
        for material in (External(library("faulty.c"), (fault,), 0) for fault in (4.0, 0.0))
    ]
    np.testing.assert_allclose(responses[0].tangent, responses[1].tangent, rtol=1e-6, atol=1e-2)


def test_bad_numbers_and_shear_out_of_plane_are_bad_input(library) -> None:
    flat = External(library("elastic.f"), STIFFNESS, components=4)
    assert (umat.update(flat, None, increments(), umat.initial_state(flat, None, STRESS)).status == 7).all()
    solid = flat._replace(components=6)
    strain = increments()
    strain[3, 2] = np.nan
    codes = umat.update(solid, None, strain, umat.initial_state(solid, None, STRESS)).status
    assert codes[3] == status.BAD_INPUT
    assert (np.delete(codes, 3) == status.OK).all()


def test_threads_give_the_same(library) -> None:
    serial = External(library("mohr_coulomb.c"), (1e4, 0.3, 5.0, 30.0, 10.0), 1)
    strain = np.tile(increments(), (5, 1))
    answers = []
    for material in (serial, serial._replace(thread_safe=True)):
        old = umat.initial_state(material, None, np.tile(STRESS, (5, 1)))
        answers.append(umat.update(material, None, strain, old))
    np.testing.assert_array_equal(answers[0].stress, answers[1].stress)


def test_what_cannot_be_loaded_gets_a_sentence(library, tmp_path: Path) -> None:
    text = tmp_path / "text.so"
    text.write_text("no library")
    for material, sentence in (
        (External(str(tmp_path / "none.so")), "there is no library"),
        (External(str(text)), "cannot be loaded"),
        (External(library("elastic.f"), STIFFNESS, 1, (1.0, 2.0)), "2 initial state variables are more than the 1"),
        (External(library("elastic.f"), STIFFNESS, components=3), "components must be 6 or 4"),
    ):
        with pytest.raises(ValueError, match=sentence):
            umat.initial_state(material, None, STRESS)
