"""What the estimates of a run are worth: ``python tests/benchmarks/effectivity.py`` writes the table of docs/study.md.

Two scenes of Toyoura sand: a block whose sides are led, so that all strain is given and isochoric, and the hollow
cylinder of ``cases/hollow_cylinder/torsion.toml``, led by loads. The true error is the distance of the stress at all
points from a run that differs in nothing but a tolerance of the points of 1e-6, or the 217 directions of `lebedev_35`,
root mean square over the stress's own. The effectivity is the estimate over it. The estimate of the directions has that
rule as its second one.
"""

from pathlib import Path
from typing import Any

import numpy as np
from page import write_table

from fabfem.boundary_value.problem import build
from fabfem.case import BoundaryValueCase, case_from, read_tables
from fabfem.fem.increment import Increment
from fabfem.fem.solve import march
from fabfem.study.variants import with_value

HOME = Path(__file__).parents[2]
CYLINDER = HOME / "cases" / "hollow_cylinder" / "torsion.toml"
FINEST, SECOND = 1e-6, "lebedev_35"
TOLERANCES = (1e-2, 1e-3, 1e-4)
RULES = ("bazant_oh_37", "icosahedral_61", "lebedev_23", "gauss_16x20")
KINDS = (("integration", TOLERANCES, FINEST), ("substeps", TOLERANCES, FINEST), ("directions", RULES, SECOND))
PLACES = {
    "integration": "material.sand.parameters.tolerance",
    "substeps": "material.sand.parameters.tolerance",
    "directions": "material.sand.directions",
}
BLOCK: dict[str, Any] = {
    "scene": {"kind": "boundary_value", "kinematics": "plane_strain"},
    "mesh": {"box": {"lower": [0.0, 0.0], "upper": [1.0, 1.0], "cells": [2, 2]}},
    "material": {
        "sand": {
            "model": "chang_hicher",
            "preset": "toyoura",
            "void_ratio": 0.75,
            "directions": "lebedev_23",
            "fabric": {"law": "zhao_kruyt", "norm": 0.208},
        }
    },
    "support": [{"boundary": "left", "fix": ["x"]}, {"boundary": "bottom", "fix": ["y"]}],
    "stage": [
        {
            "name": "ground",
            "kind": "gravity",
            "initial_stress": 100.0,
            "pressure": [{"boundary": ["right", "top"], "value": 100.0}],
        },
        {
            "name": "shear",
            "kind": "load",
            "displacement": [{"boundary": "right", "x": 0.02}, {"boundary": "top", "y": -0.02}],
            "increments": {"initial": 0.05, "maximum": 0.05},
        },
    ],
}
SCENES = {"block, all strain given": BLOCK, "hollow cylinder, led by loads": read_tables(CYLINDER)}


def ended(tables: dict[str, Any], estimate: str, value: Any) -> tuple[np.ndarray, float]:
    """Return the stress (n, 6) at the end of a run with some tolerance or rule, and what it says of its error."""
    errors = {"estimate": [estimate], "rule": SECOND, "samples": 64}
    case = case_from(with_value(tables, PLACES[estimate], value) | {"errors": errors}, CYLINDER)
    assert isinstance(case, BoundaryValueCase)
    problem, said = build(case), np.nan
    (column,) = (column for column in problem.columns if column.name == f"error_{estimate}")
    for step in march(problem.model):
        assert isinstance(step, Increment), step
        said = float(column.value(step) or np.nan)
    return step.states["all"].stress, said


def lines() -> list[str]:
    """Return the table."""
    found = ["| scene | estimate | setting | estimated | true | effectivity |", "|---|---|---|---|---|---|"]
    for name, tables in SCENES.items():
        for estimate, values, finest in KINDS:
            truth, _ = ended(tables, estimate, finest)
            for value in values:
                stress, said = ended(tables, estimate, value)
                true = float(np.linalg.norm(stress - truth) / np.linalg.norm(truth))
                found.append(f"| {name} | {estimate} | {value} | {said:.2g} | {true:.2g} | {said / true:.2g} |")
                print(found[-1], flush=True)
    return found


def main() -> None:
    """Run everything and replace the table in the page."""
    table = lines()
    write_table("study.md", "effectivity", table)


if __name__ == "__main__":
    main()
