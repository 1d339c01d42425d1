"""The strip footing that every program of the comparison solves, as fabfem does.

    python tests/benchmarks/footing.py --dofs 81k --material von_mises

Plane strain, half the domain, 7.0 × 3.6 m, symmetric about x = 0; strip pressure on 0 ≤ x ≤ 1 at the surface in ten
equal increments, no gravity; sides fixed in x, bottom fixed; squares of side 0.2 m / k cut along alternating diagonals
into 6-node triangles with three points each. solid-50k, solid-150k: a quarter of a square footing of 2 × 2 m on ground
of 10 × 10 × 3 m, 10-node tetrahedra with four points. von_mises: E = 10 MPa, ν = 0.3, σ_y = 10√3 kPa, linear isotropic
hardening 100 kPa, 50 kPa. ch: Toyoura sand, 37 directions on half the sphere (in plane strain those that symmetry
leaves), isotropic 100 kPa under a surcharge of as much, e = 0.8, the strip to 300 kPa. Newton to 1e-8 relative.

The last line is a JSON object: `wall_s` and `cpu_s` from the first line of the mesh to the last increment, without
imports and the compilation or loading of kernels, which a run of 60 dofs before it takes (`import_s`, `first_use_s`);
`settlement_m` under the centre; `peak_mb` of the process, imports included (`import_mb`); `iterations`, the linear
solves; `factorisations`, those with new factors; `phases_s`.
"""

import json
import resource
import time

BEGIN = time.perf_counter()

import argparse  # noqa: E402
import os  # noqa: E402
from typing import Any, NamedTuple  # noqa: E402

SIZES = {k: (35 * n, 18 * n) for k, n in {"5k": 1, "20k": 2, "81k": 4, "300k": 8}.items()}
SIZES |= {"solid-50k": (15, 15, 9), "solid-150k": (20, 20, 15)}
"""Cells along each axis: 5,254, 20,586, 81,490 and 324,258 dofs; 54,777 and 156,333 of solids."""
SMALL = {2: (7, 3), 3: (5, 5, 1)}
PRESSURE = {"von_mises": 50.0, "ch": 300.0}
EXACT = {"5k": 0.0270604, "20k": 0.0271602, "81k": 0.0271640}
"""Settlement under the centre on which the programs of the comparison agree, von Mises [m]."""


class Ran(NamedTuple):
    """What a run came to."""

    settlement: float
    iterations: int
    wall: float
    processor: float
    phases: dict[str, float]
    dofs: int
    factorisations: int
    end: str


def solve(cells: tuple[int, ...], material: str, solver: str, increments: int = 10) -> Ran:
    """Return what the footing with so many cells comes to."""
    import fabfem.timing
    from fabfem.fem.solve import Stopped, march

    clock = fabfem.timing.perf_counter
    begin, used, start = time.perf_counter(), time.process_time(), clock()
    model = footing(cells, material, solver, increments)
    made = clock() - start
    phases: dict[str, float] = {"mesh and space": made}
    iterations, reused, settlement, end = 0, 0, 0.0, ""
    for step in march(model):
        for name, seconds in step.timings.items():
            phases[name] = phases.get(name, 0.0) + seconds
        if isinstance(step, Stopped):
            end = f"stopped at {step.fraction:.3f}: {step.reason}"
            break
        iterations, reused = iterations + step.iterations, reused + getattr(step, "reused", 0)
        settlement = -float(step.displacement[centre(model.space)])
        del step  # two states and a tangent of all points
    wall = time.perf_counter() - begin
    phases["other"] = clock() - start - sum(phases.values())
    return Ran(
        settlement, iterations, wall, time.process_time() - used, phases, model.space.ndof, iterations - reused, end
    )


def footing(cells: tuple[int, ...], material: str, solver: str, increments: int) -> Any:
    """Return the model."""
    from fabfem.fem.box import box_mesh
    from fabfem.fem.kinematics import KINEMATICS
    from fabfem.fem.loads import Pressure
    from fabfem.fem.model import Controls, Model
    from fabfem.fem.space import build_space
    from fabfem.fem.stages import Stage
    from fabfem.fem.supports import Support

    solid = len(cells) == 3
    lower, upper = ((0.0, 0.0, -3.0), (5.0, 5.0, 0.0)) if solid else ((0.0, -3.6), (7.0, 0.0))
    mesh = box_mesh("tetra10" if solid else "triangle6", cells, lower, upper)
    top = mesh.boundary("top")
    mesh.boundaries["strip"] = top[(mesh.points[top][:, :, :-1] < 1.0 + 1e-9).all(axis=(1, 2))]
    space = build_space(mesh, KINEMATICS["solid" if solid else "plane_strain"])
    held = [("left", "x"), ("right", "x"), *(("bottom", axis) for axis in space.components)]
    held += [("front", "y"), ("back", "y")] if solid else []
    loads, zone = [Pressure("strip", PRESSURE[material])], _zone(material, space)
    if material == "ch":  # the isotropic stress is in balance with a surcharge on the whole surface
        loads.append(Pressure("top", 100.0, 1.0, 1.0))
        loads[0] = Pressure("strip", PRESSURE[material] - 100.0)
    size = 1.0 / increments
    stage = Stage("load", tuple(Support(*at) for at in held), tuple(loads), size, size, 1e-3 * size)
    return Model(space, {"all": zone}, (stage,), Controls(tolerance=1e-8, growth=1.0), solver)


def _zone(material: str, space: Any) -> Any:
    import numpy as np

    from fabfem.fem.model import Zone
    from umat import VonMises, initial_state

    everywhere = slice(0, space.npoints)
    stress = np.zeros((space.npoints, 6))
    if material == "von_mises":
        metal = VonMises(1e4, 0.3, 10.0 * 3.0**0.5, 100.0)
        return Zone(metal, None, initial_state(metal, None, stress), everywhere)
    from umat.directions import directions, mirrored
    from umat.sands import toyoura

    half = directions("bazant_oh_37")
    sand, rule = toyoura(), mirrored(half) if space.mesh.dim == 2 else half
    stress[:, :3] = 100.0
    return Zone(sand, rule, initial_state(sand, rule, stress, void_ratio=0.8), everywhere)


def centre(space: Any) -> int:
    """Return the vertical dof under the centre."""
    import numpy as np

    return (1 + int(np.argmin(np.abs(space.mesh.points).sum(axis=1)))) * space.mesh.dim - 1


def megabytes() -> float:
    """Return the largest memory of the process so far."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0


def main() -> None:
    """Read the command line and run."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--dofs", choices=SIZES, default="81k")
    parser.add_argument("--material", choices=PRESSURE, default="von_mises")
    parser.add_argument("--solver", default="auto")
    parser.add_argument("--threads", type=int, default=0)
    parser.add_argument("--clock", choices=("wall", "processor"), default="wall", help="what the phases are timed by")
    parser.add_argument("--increments", type=int, default=10)
    asked = parser.parse_args()
    if asked.threads:
        os.environ |= dict.fromkeys(("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS"), str(asked.threads))
    import fabfem.timing
    import umat
    from fabfem.fem.solve import march  # noqa: F401

    if asked.threads:
        umat.set_threads(asked.threads)
    if asked.clock == "processor":
        fabfem.timing.perf_counter = time.process_time
    imported, memory = time.perf_counter() - BEGIN, megabytes()
    solve(SMALL[len(SIZES[asked.dofs])], asked.material, asked.solver, 2)
    first = time.perf_counter() - BEGIN - imported
    ran = solve(SIZES[asked.dofs], asked.material, asked.solver, asked.increments)
    for name, seconds in ran.phases.items():
        print(f"{name:16s} {seconds:7.2f} s {100.0 * seconds / sum(ran.phases.values()):5.1f} %")
    if ran.end:
        print(ran.end)
    known = EXACT.get(asked.dofs) if asked.material == "von_mises" and asked.increments == 10 else None
    print(
        json.dumps(
            {
                "program": "fabfem",
                "dofs": ran.dofs,
                "material": asked.material,
                "wall_s": round(ran.wall, 3),
                "settlement_m": ran.settlement,
                "cpu_s": round(ran.processor, 3),
                "peak_mb": round(megabytes(), 1),
                "iterations": ran.iterations,
                "factorisations": ran.factorisations,
                "error": None if known is None else ran.settlement / known - 1.0,
                "import_s": round(imported, 3),
                "import_mb": round(memory, 1),
                "first_use_s": round(first, 3),
                "load_average": os.getloadavg()[0],
                "phases_s": {name: round(seconds, 3) for name, seconds in ran.phases.items()},
            }
        )
    )


if __name__ == "__main__":
    main()
