"""A small footing on a mesh made on the spot, for the tests of what surrounds the solver."""

from pathlib import Path

import meshio
import numpy as np
import pytest

CASE = """
title = "small footing"

[scene]
kind = "boundary_value"
kinematics = "plane_strain"

[mesh]
file = "small.inp"

[material.sand]
model = "mohr_coulomb"
youngs_modulus = 2e4
friction_angle = 30
dilation_angle = 5
cohesion = 1
unit_weight = 15.3

[[support]]
boundary = "bottom"
fix = ["x", "y"]

[[support]]
boundary = ["left", "right"]
fix = ["x"]

[[stage]]
name = "geostatic"
kind = "geostatic"
k0 = 0.5
surcharge = 2.0
pressure = [{ boundary = ["footing", "surface"], value = 2.0 }]

[[stage]]
name = "settlement"
kind = "load"
displacement = [{ boundary = "footing", x = 0.0, y = -0.04 }]
increments = { initial = 0.25, maximum = 0.25 }

[[probe]]
name = "settlement"
boundary = "footing"
component = "y"
scale = -1.0

[[reaction]]
name = "force"
boundary = "footing"
component = "y"
scale = -2.0

[[derived]]
name = "q/(gamma B)"
of = "force"
divide_by = [1.0, 15.3, 1.0]

[output]
fields = ["displacement", "stress", "strain", "p", "q"]
"""

NAMES = ("bottom", "right", "left", "footing", "surface", "soil")


def write_mesh(path: Path, across: int = 8, deep: int = 6) -> None:
    """Write a rectangle of 2 by 1.5 with named sides, the footing on the left quarter of the top."""
    x, y = np.meshgrid(np.linspace(0.0, 2.0, across + 1), np.linspace(-1.5, 0.0, deep + 1))
    number = np.arange(x.size).reshape(x.shape)
    a, b, c, d = number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]
    cells = np.concatenate([np.stack(t, axis=-1).reshape(-1, 3) for t in ((a, b, c), (a, c, d))])
    chains = {"bottom": number[0], "right": number[:, -1], "left": number[:, 0]}
    chains |= {"footing": number[-1, : across // 4 + 1], "surface": number[-1, across // 4 :]}
    edges = {name: np.stack([chain[:-1], chain[1:]], axis=1) for name, chain in chains.items()}
    blocks = [("line", part) for part in edges.values()] + [("triangle", cells)]
    members = {
        name: [
            np.arange(len(block)) if name == owner else np.zeros(0, int)
            for owner, (_, block) in zip(NAMES, blocks, strict=True)
        ]
        for name in NAMES
    }
    meshio.Mesh(np.stack([x.ravel(), y.ravel()], axis=1), blocks, cell_sets=members).write(path)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with ``case.toml`` and its mesh."""
    write_mesh(tmp_path / "small.inp")
    (tmp_path / "case.toml").write_text(CASE, encoding="utf-8")
    return tmp_path


@pytest.fixture(scope="session")
def result(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a finished run of the small footing."""
    from fabfem.run import run_case

    home = tmp_path_factory.mktemp("footing")
    write_mesh(home / "small.inp")
    (home / "case.toml").write_text(CASE, encoding="utf-8")
    run_case(home / "case.toml", home / "out", quiet=True)
    return home / "out"
