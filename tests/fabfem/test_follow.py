"""Indirect and arc-length control on a bar of two layers in simple shear, one of which softens: an exact snap-back.

The shear stress is one, so after the peak u(τ) = (h1 + h2) τ/G + h2 γp with τ = τ_y + H γp/3 ≥ τ_r.
"""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from fabfem.fem.box import box_mesh
from fabfem.fem.kinematics import KINEMATICS
from fabfem.fem.loads import Traction
from fabfem.fem.model import Controls, Model, Zone
from fabfem.fem.solve import Increment, march
from fabfem.fem.space import build_space
from fabfem.fem.stages import ArcLength, DisplacementControl, Stage
from fabfem.fem.supports import Support
from umat import Elastic, VonMises, initial_state

SHEAR, YIELD, RESIDUAL, HARDENING = 1000.0, 10.0, 4.0, -1500.0
HEIGHT, SOFT = 4.0, 1.0
YOUNG = 2.0 * SHEAR * 1.25  # ν = 0.25
LOAD = 20.0


def bar(goal: Any, supports: tuple[Support, ...] = (), **stage: Any) -> Model:
    """The lowest of four elements softens; the top is sheared by a traction LOAD times the load factor."""
    mesh = box_mesh("quad", (1, 4), (0.0, 0.0), (1.0, HEIGHT))
    at = np.flatnonzero(mesh.points[:, 1] == SOFT)
    zones = {"soft": np.array([0]), "stiff": np.array([1, 2, 3])}
    mesh = replace(mesh, zones=zones, boundaries=mesh.boundaries | {"joint": at[None, :]})
    space = build_space(mesh, KINEMATICS["plane_strain"])
    soft = VonMises(YOUNG, 0.25, YIELD * 3**0.5, HARDENING, RESIDUAL * 3**0.5)
    parts = {}
    for name, material in (("soft", soft), ("stiff", Elastic(YOUNG, 0.25))):
        points = space.points_of(mesh.zone(name))
        stress = np.zeros((len(space.weights[points]), 6))
        parts[name] = Zone(material, None, initial_state(material, None, stress), points)
    held = (Support("bottom", "x"), *(Support(side, "y") for side in ("left", "right", "bottom", "top")))
    pushed = () if supports else (Traction("top", (LOAD, 0.0)),)
    march_through = Stage("shear", (*held, *supports), pushed, goal=goal, **stage)
    return Model(space, parts, (march_through,), Controls(tolerance=1e-10))


def top(model: Model, step: Increment) -> float:
    return float(step.displacement[model.space.dofs_on("top", "x")].mean())


def exact(stress: np.ndarray, joint: np.ndarray) -> np.ndarray:
    """Displacement of the top from the stress and the displacement of the joint."""
    return joint + (HEIGHT - SOFT) * stress / SHEAR


GOALS = {
    "displacement of the joint": DisplacementControl((("joint", "x", 1.0),), 0.04),
    "opening of the layer": DisplacementControl((("joint", "x", 1.5), ("bottom", "x", -1.5)), 0.06),
    "arc length": ArcLength(0.08),
}


@pytest.mark.parametrize("goal", GOALS.values(), ids=GOALS)
@pytest.mark.parametrize("motion", [False, True], ids=["traction", "moved top"])
def test_snap_back_is_followed_exactly(goal: Any, motion: bool) -> None:
    supports = (Support("top", "x", 1.0),) if motion else ()
    model = bar(goal, supports, first=0.02, largest=0.02)
    steps = list(march(model))
    assert all(isinstance(step, Increment) for step in steps), steps[-1]
    joint = np.array([step.displacement[model.space.dofs_on("joint", "x")].mean() for step in steps])
    moved = np.array([top(model, step) for step in steps])
    factor = np.array([step.load_factor for step in steps])
    stress = np.array([step.states["stiff"].stress[0, 5] / -np.sqrt(2.0) for step in steps])
    plastic = joint / SOFT - stress / SHEAR  # plastic shear of the soft layer
    law = np.maximum(YIELD + HARDENING / 3.0 * plastic, RESIDUAL)
    yielding = plastic > 1e-9
    np.testing.assert_allclose(stress[yielding], law[yielding], rtol=1e-6)
    np.testing.assert_allclose(moved, exact(stress, joint), rtol=1e-6)
    np.testing.assert_allclose(factor * (1.0 if motion else LOAD), moved if motion else stress, rtol=1e-6)
    assert np.any(np.diff(moved) < 0.0)  # the loaded top turned back
    assert stress.max() == pytest.approx(YIELD, rel=0.05)
    assert stress[-1] == pytest.approx(RESIDUAL, rel=1e-9)


def test_without_control_the_load_stops_at_the_peak() -> None:
    *_, end = march(bar(None, first=0.05, smallest=1e-4))
    assert not isinstance(end, Increment)
    assert end.fraction * LOAD == pytest.approx(YIELD, rel=1e-3)
