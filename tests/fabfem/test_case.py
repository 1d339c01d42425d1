"""What a case may say, and the sentence for what it may not."""

import tomllib
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fabfem.case import CaseError, case_from, read_case, resolved
from fabfem.case.json_schema import schema
from fabfem.case.toml import write_toml
from fabfem.units import DIMENSIONS, FORCES, LENGTHS, Units

ROOT = Path(__file__).parents[2]
SHIPPED = sorted((ROOT / "cases").rglob("*.toml"))
FOOTING = (ROOT / "cases" / "footing" / "strip_toyoura.toml").read_text(encoding="utf-8")

BAD = {
    # what is replaced, by what, and what the sentence must say
    "unknown key": (
        "void_ratio =",
        "void_ration =",
        "material.sand.void_ration: is not a known key; did you mean 'void_ratio'?",
    ),
    "unknown table": ("[mesh]", "[mash]", "mash: is not a known key; did you mean 'mesh'?"),
    "missing key": ("void_ratio = 0.69", "", "material.sand.void_ratio: is missing"),
    "text for a number": ("= 0.69", '= "0.69"', "material.sand.void_ratio: must be a number (got '0.69')"),
    "truth for a number": ("= 0.69", "= true", "material.sand.void_ratio: must be a number (got true)"),
    "text for a list": ('fix = ["x"]', 'fix = "x"', "support[2].fix: must be a list (got 'x')"),
    "table for a list": ("[[probe]]", "[probe]", "probe: must be a list of tables: write [[probe]]"),
    "negative void ratio": ("= 0.69", "= -0.3", "material.sand.void_ratio: must be greater than 0 (got -0.3)"),
    "not a number": ("= 0.69", "= nan", "material.sand.void_ratio: must be finite (got nan)"),
    "no contacts": ("= 0.69", "= 1.7", "material.sand.void_ratio: must be less than 1.66"),
    "negative density": ("0.208", "2.6", "material.sand.fabric.norm: must be at most 2.449"),
    "unknown model": ('"chang_hicher"', '"chang_hichr"', "material.sand.model: must be one of"),
    "no model": ('model = "chang_hicher"', "", "material.sand.model: is missing"),
    "unknown stage": (
        '"geostatic"\nk0',
        '"geo"\nk0',
        "stage[geostatic].kind: must be one of 'geostatic', 'gravity', 'load', 'strength_reduction' (got 'geo')",
    ),
    "unknown kinematics": ("plane_strain", "plain_strain", "did you mean 'plane_strain'?"),
    "component that is not there": (
        "x = 0.0, y",
        "z = 0.0, y",
        "stage[settlement].displacement[1]: 'z' is no component",
    ),
    "motion without component": (", x = 0.0, y = -0.09", "", "stage[settlement].displacement[1]: gives no component"),
    "derived of nothing": ('of = "foo', 'of = "fo', "did you mean 'footing_force'?"),
    "division by zero": ("[0.9, 15.3, 0.9]", "0.0", "derived[q/(gamma B)].divide_by: must not be zero"),
    "fraction of a count": ("every = 5", "every = 2.5", "output.every: must be a whole number (got 2.5)"),
    "increments out of order": ("initial = 0.01", "initial = 0.5", "must satisfy minimum <= initial <= maximum"),
    "name given twice": ('"settlement"\nkind', '"geostatic"\nkind', "stage: the name 'geostatic' is given 2 times"),
    "tolerance that any forces meet": ("tolerance = 3e-3", "tolerance = 1.0", "solver.tolerance: must be at most 0.1"),
    "inclined bedding in a symmetric half": (
        "bedding_angle = 0.0",
        "bedding_angle = 60.0",
        "material.sand.fabric.bedding_angle: a bedding at 60 degrees is no mirror image of itself",
    ),
    "table of another kind of scene": (
        "[mesh]",
        "[initial]\np = 50.0\n\n[mesh]",
        "initial: belongs to a scene of kind element, and scene.kind is boundary_value",
    ),
    "not TOML": ("[mesh]", "[mesh", "is not valid TOML"),
    "wrong component names": (
        'kinematics = "plane_strain"',
        'kinematics = "axisymmetric"',
        "support[1].fix: 'x' is no component of axisymmetric; it has r, z",
    ),
}


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_shipped_cases_survive_printing(path: Path) -> None:
    case = read_case(path)
    assert case_from(tomllib.loads(resolved(case)), path) == case


@pytest.mark.parametrize("name", BAD)
def test_bad_input_gets_a_sentence_naming_the_place(name: str, tmp_path: Path) -> None:
    old, new, expected = BAD[name]
    assert old in FOOTING
    (tmp_path / "case.toml").write_text(FOOTING.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(CaseError) as caught:
        read_case(tmp_path / "case.toml")
    sentence = str(caught.value)
    assert sentence.startswith("case.toml: ")
    assert expected in sentence
    assert "\n" not in sentence


@pytest.mark.parametrize(
    ("angle", "azimuth", "norm", "mirrored"),
    [
        *[(0, 0, 0.208, True), (90, 0, 0.208, True), (-180, 0, 0.208, True), (60, 0, 0.0, True)],
        *[(30, 90, 0.208, True), (30, -90, 0.208, True), (30, 0, 0.208, False), (30, 45, 0.208, False)],
    ],
)
def test_a_bedding_that_mirrors_onto_itself_needs_one_half(
    angle: float, azimuth: float, norm: float, mirrored: bool
) -> None:
    tables = tomllib.loads(FOOTING)
    tables["material"]["sand"]["fabric"] |= {"bedding_angle": float(angle), "azimuth": float(azimuth), "norm": norm}
    if mirrored:
        assert case_from(tables).material["sand"].fabric.bedding_angle == angle
    else:
        with pytest.raises(CaseError, match="no mirror image of itself"):
            case_from(tables)


def test_a_byte_order_mark_is_no_part_of_the_case(tmp_path: Path) -> None:
    (tmp_path / "case.toml").write_text(FOOTING, encoding="utf-8-sig")
    assert case_from(tomllib.loads(FOOTING), tmp_path / "case.toml") == read_case(tmp_path / "case.toml")


def test_an_empty_list_is_printed_where_it_says_something() -> None:
    """A material with no zone is not one that has them all."""
    later = '[material.later]\nmodel = "elastic"\nyoungs_modulus = 1.0\nzones = []\n\n[solver]'
    text = FOOTING.replace("[solver]", later).replace('preset = "toyoura"', 'preset = "toyoura"\nzones = ["all"]')
    case = case_from(tomllib.loads(text))
    printed = resolved(case)
    assert "zones = []" in printed
    assert "traction" not in printed
    assert case_from(tomllib.loads(printed)) == case


def test_missing_file_names_its_neighbour(tmp_path: Path) -> None:
    (tmp_path / "footing.toml").touch()
    with pytest.raises(CaseError, match=r"there is no such file; did you mean 'footing\.toml'\?"):
        read_case(tmp_path / "foting.toml")


def test_files_are_relative_to_the_case(tmp_path: Path) -> None:
    case = case_from(tomllib.loads(FOOTING), tmp_path / "deep" / "case.toml")
    assert case.locate("../mesh.msh") == tmp_path / "deep" / "../mesh.msh"


def test_a_case_is_frozen() -> None:
    case = case_from(tomllib.loads(FOOTING))
    with pytest.raises(ValueError, match="frozen"):
        case.title = "other"  # type: ignore[misc]


def test_every_key_is_described() -> None:
    for name, table in schema()["$defs"].items():
        for key, value in table.get("properties", {}).items():
            assert value.get("description") or "const" in value, f"{name}.{key}"


scalar = st.booleans() | st.integers(-(2**53), 2**53) | st.floats(allow_nan=False) | st.text()
table = st.recursive(
    st.dictionaries(st.text(), st.none() | scalar | st.lists(scalar), max_size=3),
    lambda inner: st.dictionaries(st.text(), inner | st.lists(inner, max_size=2), max_size=3),
    max_leaves=6,
)


@settings(max_examples=60, deadline=None)
@given(table)
def test_toml_reads_back(tables: dict) -> None:
    assert tomllib.loads(write_toml(tables)) == _without_absent(tables)


def _without_absent(value: object) -> object:
    if isinstance(value, dict):
        return {key: _without_absent(entry) for key, entry in value.items() if entry is not None}
    return [_without_absent(entry) for entry in value] if isinstance(value, list) else value


@pytest.mark.parametrize(
    ("units", "quantity", "label"),
    [
        (Units(), "stress", "kPa"),
        (Units("mm", "N"), "stress", "MPa"),
        (Units("ft", "kip"), "stress", "kip/ft2"),
        (Units(), "line_force", "kN/m"),
        (Units(), "unit_weight", "kN/m3"),
        (Units(), "moment", "kN m"),
        (Units(), "none", "-"),
    ],
)
def test_labels_of_derived_units_are_written_out(units: Units, quantity: str, label: str) -> None:
    assert units.label(quantity) == label


@pytest.mark.parametrize("length", LENGTHS)
@pytest.mark.parametrize("force", FORCES)
def test_every_unit_of_a_case_has_labels_and_size(length: str, force: str) -> None:
    units = Units(length, force)
    assert all(units.label(quantity) for quantity in DIMENSIONS)
    assert units.pascals == pytest.approx(FORCES[force] / LENGTHS[length] ** 2)
