"""Extremes of strength and of increments in a body: friction, one increment against many, snap-back, bare surfaces."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from fabfem.extremes.sweep import Extreme, Found, sweep
from fabfem.fem.box import grid_mesh
from fabfem.fem.facets import outer_facets
from fabfem.fem.mesh import Mesh
from fabfem.verification.bearing_capacity import heavy, soil, surcharge_factor
from fabfem.verification.ground import Ground, footing
from fabfem.verification.hill_tube import TUBE
from fabfem.verification.ring import pressing, ring, ring_mesh
from fabfem.verification.scene import Answer, Tables, held, solve, stage


def extremes() -> Iterator[Extreme]:
    """Yield the sweeps."""
    angles = (20, 30, 40, 45, 50, 55, 60)
    yield sweep("weightless footing, surcharge 1: Nq", "φ = ψ [degrees]", angles, friction, 0.1, 45)
    yield sweep("smooth footing, c = q = 0: Nγ", "φ = ψ [degrees]", (20, 30, 35, 40), bare, 0.05, 40)
    sizes = (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0)
    yield sweep("Hill's tube, p/k = 1.2: u(a)", "increment / load", sizes, increment, 0.01, 0.2, True)
    lengths = (1.0, 4.0, 16.0, 64.0, 256.0, 1024.0)
    yield sweep("bar that softens: u at the end", "elastic / softening length", lengths, snap_back, 1e-6, 64.0)
    loads = (10.0, 1.0, 0.1, 0.01, 1e-3, 0.0)
    yield sweep("footing on Toyoura sand, B/500 of settlement: load", "surcharge [kPa]", loads, sand, 0.02, 0.1)


GROUND = {
    20: (4.0, 2.0, 0.1),
    30: (6.0, 3.0, 0.2),
    40: (12.0, 5.0, 0.5),
    45: (24.0, 10.0, 1.5),
    50: (24.0, 10.0, 1.5),
    55: (44.0, 18.0, 5.0),
    60: (80.0, 34.0, 25.0),
}
"""Angle of friction -> width and depth of ground that holds the mechanism, settlement to the limit, all in B."""


def friction(angle: float) -> Found:
    """Return Nq of a smooth footing on a coarse mesh."""
    width, depth, settlement = GROUND[int(angle)]
    answer = solve(
        footing(soil(angle, cohesion=0.0), settlement, False, 1.0), Ground(width, depth, 0.02, 1.25).mesh("quad")
    )
    load = answer.final("load")
    return Found(None if load is None else 1.0 + load, surcharge_factor(angle), answer.stopped)


def bare(angle: float) -> Found:
    """Return Nγ of a smooth footing without cohesion or surcharge."""
    row = heavy(int(angle), rough=False)
    return Found(row.got, row.reference, row.note if row.got is None else "")


def increment(size: float) -> Found:
    """Return the movement of the inner wall of Hill's tube in increments of a size, over that in 1/200."""
    answers = [_tube(part) for part in (size, 0.005)]
    ends = [answer.final("inner") for answer in answers]
    return Found(ends[0], ends[1] or np.nan, answers[0].stopped)


def snap_back(length: float) -> Found:
    """Return the movement of the end of a bar, one part of which has softened to its residual strength.

    Shear stress τ: u = (1 + length) τ/G + γp with τ = τ_r at the end; the rest is `length` times as long.
    """
    shear, strength, residual = 1000.0, 10.0, 4.0
    joint_end = 0.04
    answer = solve(_bar(shear, strength, residual, joint_end), _bar_mesh(length))
    exact = joint_end + length * residual / shear
    return Found(answer.final("end"), exact, answer.stopped)


def sand(surcharge: float) -> Found:
    """Return the load of a footing under a surcharge, over that in half the increments."""
    answers = [on_sand(surcharge, size) for size in (0.1, 0.05)]
    loads = [answer.final("load") for answer in answers]
    return Found(loads[0], loads[1] or np.nan, answers[0].stopped or answers[1].stopped)


def _tube(size: float) -> Answer:
    mesh = ring_mesh("quad", np.linspace(1.0, 2.0, 41))
    return solve(ring(TUBE, [pressing("inner", 1.2, initial=size, maximum=size)]), mesh)


def _bar_mesh(length: float) -> Mesh:
    mesh = grid_mesh("quad", [np.array([0.0, 1.0]), np.array([0.0, 1.0, 1.0 + length])])
    joint = outer_facets(mesh.cells[:1], "quad", np.flatnonzero(mesh.points[:, 1] == 1.0))
    zones = {"soft": np.array([0]), "stiff": np.array([1])}
    return replace(mesh, zones=zones, boundaries=mesh.boundaries | {"joint": joint})


def _bar(shear: float, strength: float, residual: float, joint: float) -> Tables:
    young = {"youngs_modulus": 2.5 * shear, "poisson_ratio": 0.25}
    root = 3.0**0.5
    soft = {"yield_stress": strength * root, "hardening_modulus": -1500.0, "residual_stress": residual * root}
    control = {"kind": "displacement", "change": joint, "terms": [{"boundary": "joint", "component": "x"}]}
    return {
        "scene": {"kind": "boundary_value", "kinematics": "plane_strain"},
        "mesh": {"order": 1, "volume_strain": "pointwise"},
        "material": {
            "soft": {"model": "von_mises", "zones": ["soft"]} | young | soft,
            "stiff": {"model": "elastic", "zones": ["stiff"]} | young,
        },
        "solver": {"tolerance": 1e-10},
        "support": held(bottom="xy", left="y", right="y", top="y"),
        "stage": [
            stage("shear", 0.02, 0.02, control=control, traction=[{"boundary": "top", "x": 2.0 * strength}]),
        ],
        "probe": [{"name": "end", "boundary": "top", "component": "x"}],
    }


def on_sand(surcharge: float, size: float, solver: Tables | None = None) -> Answer:
    """Return the answer of a rough footing pressed into Toyoura sand, without viscosity or held points."""
    material: Tables = {
        "model": "chang_hicher",
        "preset": "toyoura",
        "directions": "bazant_oh_21",
        "void_ratio": 0.75,
        "unit_weight": 15.0,
        "fabric": {"norm": 0.208},
    }
    tables = footing(material, 0.002, True, surcharge)
    tables["stage"][-1] = stage("settlement", size, size, **{"displacement": tables["stage"][-1]["displacement"]})
    tables["solver"] = {"tolerance": 1e-6} | (solver or {})
    return solve(tables, Ground(2.0, 1.0, 0.1, 1.5).mesh("quad"))
