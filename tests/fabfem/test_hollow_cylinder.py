"""Averages of a hollow cylinder against the exact stress of an elastic one: Lamé's walls and Saint-Venant's torsion."""

from pathlib import Path

import numpy as np
import pytest

from fabfem.boundary_value.hollow_cylinder import shape_of
from fabfem.boundary_value.problem import build
from fabfem.case import CaseError, read_case
from fabfem.output.history import read_history
from fabfem.run import run_case

INNER, OUTER, HEIGHT = 0.03, 0.05, 0.02
YOUNG, POISSON, TURN = 1e4, 0.25, 0.01
P_IN, P_OUT, TOP = 120.0, 80.0, 150.0
CASE = f"""
[scene]
kind = "boundary_value"
kinematics = "axisymmetric_torsion"

[mesh]
box = {{ lower = [{INNER}, 0.0], upper = [{OUTER}, {HEIGHT}], cells = [8, 1] }}

[material.clay]
model = "elastic"
youngs_modulus = {YOUNG}
poisson_ratio = {POISSON}

[[support]]
boundary = "bottom"
fix = ["z", "theta"]

[[stage]]
name = "load"
kind = "load"
pressure = [{{ boundary = "left", value = {P_IN} }}, {{ boundary = "right", value = {P_OUT} }}]
traction = [{{ boundary = "top", z = -{TOP} }}]
rigid = [{{ boundary = "top", contact = "ribbed", motion = {{ rotation = {TURN} }} }}]
increments = {{ initial = 1.0, maximum = 1.0 }}

[[probe]]
name = "mean_hoop"
kind = "mean"
field = "stress"
entry = "zz"

[[probe]]
name = "radial_spread"
kind = "deviation"
field = "stress"
entry = "xx"

[hollow_cylinder]
inner = "left"
outer = "right"
platen = "top"
"""
AREA, CUBES = OUTER**2 - INNER**2, OUTER**3 - INNER**3
PRESSURE = (P_OUT * OUTER**2 - P_IN * INNER**2) / AREA
FLUCTUATION = (P_IN - P_OUT) * (INNER * OUTER) ** 2 / AREA
"""Lamé: the stress is PRESSURE ± FLUCTUATION/r² along the radius and around the axis."""
INVERSE_SQUARE = 2.0 * np.log(OUTER / INNER) / AREA
"""Volume mean of 1/r²."""
TWIST = TURN * YOUNG / (2.0 * (1.0 + POISSON)) / HEIGHT
"""The shear stress is TWIST times r."""
WIDENS = (1.0 + POISSON) / YOUNG * FLUCTUATION, ((1.0 - POISSON) * PRESSURE - POISSON * TOP) / YOUNG
"""A radius r moves by WIDENS[0]/r - WIDENS[1] r."""

EXACT = {
    "hgs_sigma_z": TOP,
    "hgs_sigma_r": (P_OUT * OUTER + P_IN * INNER) / (OUTER + INNER),
    "hgs_sigma_theta": (P_OUT * OUTER - P_IN * INNER) / (OUTER - INNER),
    "hgs_tau": 0.75 * TWIST * (OUTER**4 - INNER**4) / CUBES,
    "hgs_eps_z": (TOP - 2.0 * POISSON * PRESSURE) / YOUNG,
    "hgs_eps_r": WIDENS[1] + WIDENS[0] / (INNER * OUTER),
    "hgs_eps_theta": WIDENS[1] - WIDENS[0] / (INNER * OUTER),
    "hgs_gamma": 2.0 * TURN * CUBES / (3.0 * HEIGHT * AREA),
    "mean_sigma_z": TOP,
    "mean_sigma_r": PRESSURE + FLUCTUATION * INVERSE_SQUARE,
    "mean_sigma_theta": PRESSURE - FLUCTUATION * INVERSE_SQUARE,
    "mean_tau": TWIST * 2.0 * CUBES / (3.0 * AREA),
    "mean_gamma": 2.0 * TURN * CUBES / (3.0 * HEIGHT * AREA),
    "mean_eps_r": WIDENS[1] + WIDENS[0] * INVERSE_SQUARE,
    "mean_eps_theta": WIDENS[1] - WIDENS[0] * INVERSE_SQUARE,
    "mean_hoop": PRESSURE - FLUCTUATION * INVERSE_SQUARE,
    "radial_spread": FLUCTUATION * np.sqrt(1.0 / (INNER * OUTER) ** 2 - INVERSE_SQUARE**2),
}


@pytest.fixture(scope="module")
def row(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Return the last row of the history of the elastic cylinder by column."""
    home = tmp_path_factory.mktemp("cylinder")
    (home / "case.toml").write_text(CASE, encoding="utf-8")
    outcome = run_case(home / "case.toml", home / "out", quiet=True)
    assert outcome.status == "completed", outcome.reason
    header, rows = read_history(home / "out" / "history.csv")
    return dict(zip((name.partition(" [")[0] for name in header), rows[-1], strict=True))


@pytest.mark.parametrize(("column", "exact"), EXACT.items())
def test_averages_are_those_of_the_exact_stress(row: dict[str, str], column: str, exact: float) -> None:
    assert float(row[column]) == pytest.approx(exact, rel=2e-3)


@pytest.mark.parametrize(
    ("stress", "alpha", "b"),
    [
        ((3.0, 1.0, 1.0, 0.0), 0.0, 0.0),
        ((1.0, 1.0, 3.0, 0.0), 90.0, 0.0),
        ((2.0, 2.0, 2.0, 1.0), 45.0, 0.5),
        ((2.0, 2.0, 2.0, -1.0), -45.0, 0.5),
        ((3.0, 2.0, 2.0, np.sqrt(3.0) / 2.0), 30.0, 0.25),
        ((2.0, 3.0, 3.0, np.sqrt(3.0) / 2.0), 60.0, 0.75),
    ],
)
def test_equal_pressures_mean_b_is_the_squared_sine_of_alpha(
    stress: tuple[float, float, float, float], alpha: float, b: float
) -> None:
    assert shape_of(*stress) == pytest.approx((alpha, b), abs=1e-9)


WRONG = [
    ('kinematics = "axisymmetric_torsion"', 'kinematics = "axisymmetric"', "hollow_cylinder"),
    ('inner = "left"', 'inner = "right"', "the inner wall has radius"),
    ('outer = "right"', 'outer = "top"', "the outer wall is no cylinder"),
    ('platen = "top"', 'platen = "lid"', "hollow_cylinder.platen: the mesh has no boundary 'lid'"),
    ('field = "stress"\nentry = "zz"', 'field = "stress"', "probe[mean_hoop].entry: 'stress' is a tensor"),
    ('field = "stress"\nentry = "zz"', 'field = "p"\nentry = "zz"', "probe[mean_hoop].entry: 'p' is a number"),
    ('field = "stress"\nentry = "zz"', 'field = "void"', "probe[mean_hoop].field: no material here has a field 'void'"),
    ('field = "stress"\nentry = "zz"', "", "probe[mean_hoop].field: goes with a mean"),
    ('field = "stress"\nentry = "zz"', 'field = "p"\nboundary = "top"', "neither a boundary nor a point"),
    ('field = "stress"\nentry = "zz"', 'field = "p"\nzones = "lid"', "probe[mean_hoop].zones"),
]


@pytest.mark.parametrize(("right", "wrong", "said"), WRONG)
def test_a_wrong_case_gets_one_sentence(tmp_path: Path, right: str, wrong: str, said: str) -> None:
    assert right in CASE
    text = CASE.replace(right, wrong)
    if "torsion" in right:
        text = text.replace('fix = ["z", "theta"]', 'fix = ["z"]')
    (tmp_path / "case.toml").write_text(text, encoding="utf-8")
    with pytest.raises(CaseError) as refused:
        build(read_case(tmp_path / "case.toml"))
    assert said in str(refused.value)
    assert "\n" not in str(refused.value)


def test_ribs_need_torsion(tmp_path: Path) -> None:
    text = (
        CASE.replace("axisymmetric_torsion", "axisymmetric").replace('["z", "theta"]', '["z"]').replace("rotation", "z")
    )
    (tmp_path / "case.toml").write_text(text[: text.index("[hollow_cylinder]")], encoding="utf-8")
    with pytest.raises(CaseError, match="a ribbed rigid body needs the kinematics axisymmetric_torsion"):
        build(read_case(tmp_path / "case.toml"))
