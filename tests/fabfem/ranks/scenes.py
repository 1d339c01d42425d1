"""Small scenes that a shared run is tried on, and the program that runs them, alone or as one of several processes.

``python scenes.py FOLDER NAME ... [--resume]`` runs each into a folder of its name, or goes on there.
"""

import sys
from pathlib import Path

CLAY = """
[material.clay]
model = "von_mises"
youngs_modulus = 5000.0
poisson_ratio = 0.3
yield_stress = 17.320508
unit_weight = 18.0
porosity = 0.4
conductivity = 1e-4
"""
FLAT = """title = "a scene on several ranks"
[scene]
kind = "boundary_value"
kinematics = "plane_strain"
[mesh]
box = {{ shape = "{shape}", cells = [{cells}], lower = [0.0, 0.0], upper = [3.0, 2.0] }}
order = {order}
[[support]]
boundary = "bottom"
fix = ["x", "y"]
[[support]]
boundary = ["left", "right"]
fix = ["x"]
[[probe]]
name = "corner"
point = [3.0, 2.0]
component = "y"
[[probe]]
name = "top"
boundary = "top"
component = "y"
[[probe]]
name = "spread"
kind = "deviation"
field = "p"
[[reaction]]
name = "base"
boundary = "left"
component = "x"
"""
DRY = (
    FLAT.format(shape="quad", cells="6, 4", order=2)
    + CLAY
    + """
[checkpoint]
increments = 3
[[stage]]
name = "ground"
kind = "geostatic"
k0 = 0.6
[[stage]]
name = "push"
kind = "load"
pressure = [{ boundary = "top", value = 30.0 }]
traction = [{ boundary = "top", x = 9.0 }]
increments = { initial = 0.2, minimum = 1e-4, maximum = 0.2 }
[output]
fields = ["displacement", "stress", "p"]
every = 3
"""
)
PATCHES = DRY.replace('shape = "quad"', 'shape = "triangle"').replace("order = 2", "order = 1")
SOLID = (
    DRY.replace("plane_strain", "solid").replace('"quad"', '"hexahedron"').replace("[6, 4]", "[4, 3, 3]")
    .replace("lower = [0.0, 0.0], upper = [3.0, 2.0]", "lower = [0.0, 0.0, 0.0], upper = [3.0, 2.0, 2.0]")
    .replace('fix = ["x", "y"]', 'fix = ["x", "y", "z"]').replace("point = [3.0, 2.0]", "point = [3.0, 2.0, 2.0]")
    .replace('component = "y"', 'component = "z"')
    .replace("[[reaction]]", '[[support]]\nboundary = ["front", "back"]\nfix = ["y"]\n[[reaction]]')
)  # fmt: skip
WET = (
    (
        FLAT.format(shape="quad", cells="4, 4", order=2)
        + CLAY
        + """
[water]
excess = true
bulk_modulus = 2.0e6
unit_weight = 10.0
[[probe]]
name = "pressure"
kind = "pore_pressure"
point = [1.5, 0.0]
[[stage]]
name = "push"
kind = "load"
drainage = "undrained"
initial_stress = 5.0
traction = [{ boundary = "top", x = 2.0, y = -20.0 }]
increments = { initial = 0.5, minimum = 1e-4, maximum = 0.5 }
[[stage]]
name = "wait"
kind = "load"
drainage = "seepage"
drains = ["top"]
duration = 2.0
time_tolerance = 0.05
increments = { initial = 0.02, minimum = 1e-4, maximum = 0.25 }
"""
    )
    .replace("initial_stress = 5.0\n", "")
    .replace("unit_weight = 18.0", "unit_weight = 0.0")
)
BODY = (
    (
        FLAT.format(shape="quad", cells="6, 4", order=2)
        + CLAY
        + """
[[stage]]
name = "push"
kind = "load"
rigid = [{ boundary = "top", point = [1.8, 2.0], force = { y = -100.0 } }]
control = { kind = "displacement", terms = [{ boundary = "top", component = "y" }], change = -0.02 }
increments = { initial = 0.25, minimum = 1e-3, maximum = 0.25 }
[[stage]]
name = "turn"
kind = "load"
rigid = [{ boundary = "top", contact = "smooth", point = [1.8, 2.0], motion = { y = -0.002, rotation = 0.001 } }]
increments = { initial = 0.5, minimum = 1e-3, maximum = 0.5 }
"""
    )
    .replace("unit_weight = 18.0", "unit_weight = 0.0")
    .replace('["left", "right"]', '["left"]')
)
ARC = BODY.replace(
    '{ kind = "displacement", terms = [{ boundary = "top", component = "y" }], change = -0.02 }',
    '{ kind = "arc_length", length = 0.01 }',
)
WEAK = (
    (
        FLAT.format(shape="quad", cells="6, 4", order=2)
        + CLAY
        + """
[[stage]]
name = "weight"
kind = "gravity"
increments = { initial = 1.0, maximum = 1.0 }
[[stage]]
name = "safety"
kind = "strength_reduction"
step = 0.2
tolerance = 0.1
"""
    )
    .replace('["left", "right"]', '"left"')
    .replace("yield_stress = 17.320508", "yield_stress = 25.0")
)
"""A bank that nothing holds on its right side, weakened until it fails."""
SURE = (
    FLAT.format(shape="quad", cells="4, 3", order=2)
    + """
[material.sand]
model = "chang_hicher"
preset = "toyoura"
void_ratio = 0.7
unit_weight = 15.0
fabric = { norm = 0.2 }
[errors]
estimate = ["equilibrium", "integration", "discretisation", "directions", "substeps"]
rule = "lebedev_17"
samples = 7
[checkpoint]
increments = 2
[[stage]]
name = "rest"
kind = "geostatic"
surcharge = 50.0
pressure = [{ boundary = "top", value = 50.0 }]
[[stage]]
name = "push"
kind = "load"
traction = [{ boundary = "top", x = 12.0, y = -10.0 }]
increments = { initial = 0.25, maximum = 0.25 }
[output]
fields = ["stress", "discretisation_error"]
"""
)
"""Sand that says how wrong it is: patches and samples that do not care where the mesh is divided."""
FAILS = (
    SURE[: SURE.index("[errors]")] + SURE[SURE.index("[[stage]]") : SURE.index("[output]")]
).replace("x = 12.0, y = -10.0", "x = 90.0, y = -10.0").replace(
    "initial = 0.25, maximum", "initial = 0.25, minimum = 0.05, maximum"
)  # fmt: skip
"""The same sand sheared beyond its strength: increments that are halved, and a reason with a place."""
SCENES = {
    "dry": DRY,
    "sure": SURE,
    "patches": PATCHES,
    "solid": SOLID,
    "wet": WET,
    "body": BODY,
    "arc": ARC,
    "weak": WEAK,
    "fails": FAILS,
}
SCENES |= {
    "multigrid": SOLID + '[solver]\nlinear = "multigrid"\ntolerance = 1e-8\n',
    "held": BODY + '[solver]\nlinear = "multigrid"\ntolerance = 1e-8\n',
    "options": SOLID + '[solver]\nlinear = "multigrid"\npetsc = { ksp_max_it = 1 }\n',
    "ill": DRY + "[solver]\ndiagnose = true\n",
    "split": WET + '[solver]\nlinear = "multigrid"\ntolerance = 1e-8\n',
}


def main(home: Path, names: list[str]) -> None:
    """Run some scenes."""
    sys.path.insert(0, str(Path(__file__).parents[3]))
    from fabfem.case import case_from, read_tables
    from fabfem.parallel.world import ended_together, first
    from fabfem.restart import Restart
    from fabfem.run import run_case

    for name in [name for name in names if name != "--resume"]:
        text = home / f"{name}.toml"
        with ended_together(traceback=True):
            case = case_from(read_tables(text), text)
            outcome = run_case(case, home / name, quiet=True, restart=Restart("--resume" in names))
        if first():
            print(name, outcome.status, outcome.reason, flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2:])
