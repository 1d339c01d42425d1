"""Small scenes of every material, kinematics and way of driving a stage, as tables of a case."""

from typing import Any

SAND = {
    **{"model": "chang_hicher", "preset": "toyoura", "void_ratio": 0.69, "unit_weight": 15.3},
    **{"directions": "lebedev_17", "parameters": {"open_pressure": 1e-3}},
}
LEVEL = {"fabric": {"law": "zhao_kruyt", "norm": 0.208}}
FABRIC = {"fabric": {"law": "zhao_kruyt", "norm": 0.208, "bedding_angle": 30.0}}
STIFFNESS = {"youngs_modulus": 2e4, "poisson_ratio": 0.25, "unit_weight": 16.0}
MOHR = STIFFNESS | {"model": "mohr_coulomb", "friction_angle": 30.0, "dilation_angle": 5.0, "cohesion": 2.0}
ELASTIC = STIFFNESS | {"model": "elastic"}
METAL = STIFFNESS | {"model": "von_mises", "yield_stress": 60.0}
DRUCKER = STIFFNESS | {"model": "drucker_prager", "friction_slope": 1.2, "dilation_slope": 0.3, "strength": 5.0}
BESIDE = {"boundary": "right", "value": 12.0}
PRESSED = [{"boundary": "top", "value": 20.0}, BESIDE]
GROUND = {"name": "ground", "kind": "geostatic", "k0": 0.5, "surcharge": 20.0, "pressure": PRESSED}
STEPS = {"initial": 0.1, "maximum": 0.2}


def scene(material: dict[str, Any], *stages: dict[str, Any], **more: Any) -> dict[str, Any]:
    """Return the tables of a block under its own weight and a surcharge, then led through further stages."""
    sides = [{"boundary": "bottom", "fix": ["x", "y"]}, {"boundary": "left", "fix": ["x"]}]
    tables: dict[str, Any] = {
        "scene": {"kind": "boundary_value", "kinematics": "plane_strain"},
        "mesh": {"box": {"cells": [3, 2], "lower": [0.0, -1.0], "upper": [1.5, 0.0]}},
        "checkpoint": {"increments": 1},
        "material": {"soil": material},
        "support": sides,
        "stage": [GROUND, *stages],
        "probe": [{"name": "head", "point": [0.0, 0.0], "component": "y"}],
        "reaction": [{"name": "base", "boundary": "bottom", "component": "y"}],
        "output": {"fields": ["displacement", "stress", "strain"], "every": 2},
    }
    return tables | more


def pushed(settlement: float = 0.02, **more: Any) -> dict[str, Any]:
    """Return the stage that moves the top down."""
    motion = [{"boundary": "top", "y": -settlement}]
    return {"name": "push", "kind": "load", "displacement": motion, "increments": STEPS, "pressure": [BESIDE]} | more


def consolidated() -> dict[str, Any]:
    """Return a layer that is loaded undrained and then drains."""
    top = [{"boundary": "top", "value": 70.0}, BESIDE]
    fill = {"name": "fill", "kind": "load", "drainage": "undrained", "pressure": top}
    wait = {"name": "wait", "kind": "load", "drainage": "seepage", "drains": "top", "duration": 1e4, "pressure": top}
    water = {"water": {"unit_weight": 9.81, "level": 0.0, "excess": True}}
    soil = MOHR | {"saturated_unit_weight": 19.81, "conductivity": 1e-5}
    return scene(soil, fill, wait | {"increments": {"initial": 0.01, "maximum": 0.3}}, **water)


def weakened() -> dict[str, Any]:
    """Return a block without surcharge nor support on its right, whose factor of safety is looked for."""
    sides = [{"boundary": "bottom", "fix": ["x", "y"]}, {"boundary": "left", "fix": ["x"]}]
    mesh = {"box": {"cells": [4, 3], "lower": [0.0, 0.0], "upper": [2.0, 1.5]}}
    clay = STIFFNESS | {"model": "mohr_coulomb", "friction_angle": 0.0, "cohesion": 10.0}
    stages = [{"name": "weight", "kind": "gravity"}, {"name": "safety", "kind": "strength_reduction", "step": 0.2}]
    points = [{"name": "head", "point": [2.0, 1.5], "component": "y"}]
    return scene(clay, stage=stages, support=sides, mesh=mesh, probe=points)


def pressed_by_a_body() -> dict[str, Any]:
    """Return a block of metal under an eccentric force on a rigid body."""
    body = [{"boundary": "top", "point": [0.6, 0.0], "force": {"y": -50.0}}]
    return scene(METAL, {"name": "press", "kind": "load", "rigid": body, "pressure": [BESIDE], "increments": STEPS})


def along(kind: dict[str, Any]) -> dict[str, Any]:
    """Return a block of metal under a control that lets the load follow."""
    load = [{"boundary": "top", "value": 500.0}, BESIDE]
    return scene(METAL, {"name": "press", "kind": "load", "pressure": load, "control": kind, "increments": STEPS})


AROUND = {
    "mesh": {"box": {"cells": [2, 2], "lower": [0.3, 0.0], "upper": [0.5, 0.4]}},
    "probe": [{"name": "head", "boundary": "top", "component": "z"}],
    "reaction": [{"name": "base", "boundary": "bottom", "component": "z"}],
}
CONFINED = {
    **{"name": "confined", "kind": "gravity", "initial_stress": 50.0},
    "pressure": [{"boundary": ["left", "right", "top"], "value": 50.0}],
}
SHORTENED = {"boundary": "top", "r": 0.0, "z": -0.008}
AXISYMMETRIC = AROUND | {
    "scene": {"kind": "boundary_value", "kinematics": "axisymmetric"},
    "support": [{"boundary": "bottom", "fix": ["r", "z"]}],
    "stage": [CONFINED, {"name": "push", "kind": "load", "displacement": [SHORTENED], "increments": STEPS}],
}
TORSION = AROUND | {
    "scene": {"kind": "boundary_value", "kinematics": "axisymmetric_torsion"},
    "support": [{"boundary": "bottom", "fix": ["r", "z", "theta"]}],
    "stage": [
        CONFINED,
        {
            **{"name": "twist", "kind": "load", "displacement": [SHORTENED | {"z": -0.002, "theta": 0.008}]},
            "increments": STEPS,
        },
    ],
}
# loads in proportion, led by the displacement that works with them; averages of a hollow cylinder and errors
HOLLOW = AROUND | {
    "scene": {"kind": "boundary_value", "kinematics": "axisymmetric_torsion"},
    "support": [{"boundary": "bottom", "fix": ["z", "theta"]}],
    "hollow_cylinder": {"inner": "left", "outer": "right", "platen": "top"},
    "stage": [
        CONFINED,
        {
            **{"name": "shear", "kind": "load", "rigid": [{"boundary": "top", "contact": "ribbed"}]},
            "pressure": [{"boundary": ["left", "right"], "value": 35.0}, {"boundary": "top", "value": 80.0}],
            "traction": [{"boundary": "top", "theta": 40.0}],
            "control": {
                **{"kind": "displacement", "change": 0.004},
                "terms": [
                    {"boundary": "top", "component": "z", "factor": -0.5},
                    {"boundary": "top", "component": "theta", "factor": 0.866},
                ],
            },
            "increments": STEPS,
        },
    ],
}
SOLID = {
    "scene": {"kind": "boundary_value", "kinematics": "solid"},
    "mesh": {"box": {"shape": "hexahedron", "cells": [2, 1, 1], "lower": [0.0, 0.0, 0.0], "upper": [2.0, 1.0, 1.0]}},
    "support": [{"boundary": "bottom", "fix": ["x", "y", "z"]}],
    "probe": [{"name": "head", "boundary": "top", "component": "z"}],
    "stage": [
        {
            **{"name": "push", "kind": "load", "displacement": [{"boundary": "top", "x": 0.01, "z": -0.01}]},
            "increments": STEPS,
        }
    ],
}
ERRORS = {"errors": {"estimate": ["equilibrium", "integration", "directions"], "rule": "lebedev_11", "samples": 3}}
ROUTINE = {
    **{"model": "umat", "library": "mohr_coulomb.so", "unit_weight": 16.0},
    **{"properties": [2e4, 0.25, 2.0, 30.0, 5.0], "state_variables": 1},
}
OTHER = {"stiff": ELASTIC | {"zones": []}}
CHANGED = pushed(0.01, name="again", change=[{"zones": "all", "material": "stiff"}])
SUPERLU = {"solver": {"linear": "superlu"}}
VISCOUS = {"solver": {"tolerance": 1e-3, "viscosity": 2e-4, "held": 0.01}}

SCENES = {
    "elastic": scene(ELASTIC, pushed()),
    "von_mises": scene(METAL, pushed()),
    "drucker_prager": scene(DRUCKER, pushed()),
    "mohr_coulomb": scene(MOHR, pushed()),
    "mohr_coulomb_superlu": scene(MOHR, pushed(), **SUPERLU),
    "chang_hicher_isotropic": scene(SAND, pushed(0.01)),
    "chang_hicher_fabric_errors": scene(SAND | FABRIC, pushed(0.01), **ERRORS),
    "chang_hicher_viscous": scene(SAND | FABRIC, pushed(0.02), **VISCOUS),
    "change_of_material": scene(MOHR, pushed(), CHANGED) | {"material": {"soil": MOHR | {"zones": ["all"]}} | OTHER},
    "consolidation": consolidated(),
    "strength_reduction": weakened(),
    "arc_length": along({"kind": "arc_length", "length": 0.05}),
    "displacement_control": along(
        {"kind": "displacement", "terms": [{"boundary": "top", "component": "y"}], "change": -0.03}
    ),
    "solid": scene(METAL, **SOLID),
    "rigid_body": pressed_by_a_body(),
    "compiled_umat": scene(ROUTINE, pushed()),
    "axisymmetric": scene(MOHR, **AXISYMMETRIC),
    "axisymmetric_torsion": scene(SAND | LEVEL, **TORSION),
    "hollow_cylinder": scene(SAND | LEVEL, **HOLLOW, **ERRORS),
}


def element(material: dict[str, Any], *stages: dict[str, Any], **more: Any) -> dict[str, Any]:
    """Return the tables of an element test: compression to 100, then further stages."""
    alone = {key: value for key, value in material.items() if key != "unit_weight"}
    first = {"name": "more", "kind": "isotropic", "to": 100.0, "increments": 10}
    tables = {"scene": {"kind": "element"}, "material": {"soil": alone}, "initial": {"p": 50.0}}
    return tables | {"stage": [first, *stages]} | more


SHEAR = {"name": "shear", "kind": "triaxial", "drainage": "drained", "shear_strain": 0.02, "increments": 20}
CYCLES = SHEAR | {"name": "again", "drainage": "undrained", "shear_strain": [0.001, -0.001], "cycles": 2}
PROBES = {"name": "probes", "kind": "probe", "of": "stress", "size": 1.0, "directions": 12}
ROSES = {"output": {"roses": {"stage": "shear", "strain": [0.0, 0.005]}}}
ELEMENTS = {
    "elastic": element(ELASTIC, SHEAR),
    "von_mises": element(METAL, SHEAR, CYCLES),
    "chang_hicher": element(SAND | FABRIC, SHEAR, PROBES, SHEAR | {"name": "on", "keep_strain": True}, **ROSES),
}
