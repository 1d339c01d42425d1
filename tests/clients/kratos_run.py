"""Solve a scene in Kratos Multiphysics with a compiled UMAT: `python kratos_run.py SCENE.json RESULT.csv`.

Needs the packages KratosGeoMechanicsApplication and KratosLinearSolversApplication and nothing of this repository.
The scene says nodes, hexahedra, properties, initial stress, what is fixed, forces and the nodes that are driven; the
result has a line for each increment, with the displacement and the force of the driven nodes. The law
`SmallStrainUMAT3DLaw` loads the library; it orders shears 12, 23, 13, so that scenes must have none out of a plane.
"""

import csv
import json
import sys
from pathlib import Path
from typing import Any

import KratosMultiphysics as Kratos
import KratosMultiphysics.GeoMechanicsApplication  # registers the laws
import KratosMultiphysics.StructuralMechanicsApplication as Structural

DISPLACEMENTS = {"x": Kratos.DISPLACEMENT_X, "y": Kratos.DISPLACEMENT_Y, "z": Kratos.DISPLACEMENT_Z}
REACTIONS = {"x": Kratos.REACTION_X, "y": Kratos.REACTION_Y, "z": Kratos.REACTION_Z}
LOADS = {"x": Structural.POINT_LOAD_X, "y": Structural.POINT_LOAD_Y, "z": Structural.POINT_LOAD_Z}
named = Kratos.KratosGlobals.GetVariable
LAW, ELEMENT, LOAD = "SmallStrainUMAT3DLaw", "SmallDisplacementElement3D8N", "PointLoadCondition3D1N"


def model_part(model: Any, scene: dict[str, Any]) -> Any:
    """Return the mesh with material, forces and fixities."""
    part = model.CreateModelPart("soil", 2)
    part.ProcessInfo[Kratos.DOMAIN_SIZE] = 3
    for variable in (Kratos.DISPLACEMENT, Kratos.REACTION, Structural.POINT_LOAD, Kratos.VOLUME_ACCELERATION):
        part.AddNodalSolutionStepVariable(variable)
    for number, place in enumerate(scene["nodes"], 1):
        part.CreateNewNode(number, *place)
    properties = part.GetProperties()[1]
    properties[Kratos.CONSTITUTIVE_LAW] = Kratos.KratosGlobals.GetConstitutiveLaw(LAW).Clone()
    properties[named("UDSM_NAME")], properties[named("IS_FORTRAN_UDSM")] = scene["library"], True
    properties[named("UMAT_PARAMETERS")] = Kratos.Vector(scene["properties"])
    properties[named("STATE_VARIABLES")] = Kratos.Vector([0.0] * scene["state_variables"])
    properties[Kratos.DENSITY], properties[Kratos.THICKNESS] = 0.0, 1.0
    for number, nodes in enumerate(scene["elements"], 1):
        part.CreateNewElement(ELEMENT, number, [node + 1 for node in nodes], properties)
    for axis in "xyz":
        Kratos.VariableUtils().AddDof(DISPLACEMENTS[axis], REACTIONS[axis], part)
    for number, (node, force) in enumerate(scene["forces"], 1):
        part.CreateNewCondition(LOAD, number, [node + 1], properties)
        for axis, value in zip("xyz", force, strict=True):
            part.Nodes[node + 1].SetSolutionStepValue(LOADS[axis], value)
    for node, axis in scene["fixed"]:
        part.Nodes[node + 1].Fix(DISPLACEMENTS[axis])
    for node in scene["driven"]:
        part.Nodes[node + 1].Fix(DISPLACEMENTS[scene["axis"]])
    return part


def strategy_of(part: Any, tolerance: float) -> Any:
    """Return Newton's method with the tangent of the law and a direct solver."""
    from KratosMultiphysics import python_linear_solver_factory

    solver = python_linear_solver_factory.ConstructSolver(
        Kratos.Parameters('{"solver_type": "LinearSolversApplication.sparse_lu"}')
    )
    scheme = Kratos.ResidualBasedIncrementalUpdateStaticScheme()
    # where nothing is out of balance from the start, the relative residual is 0/0; then the displacement decides
    criterion = Kratos.OrCriteria(
        Kratos.ResidualCriteria(tolerance, tolerance), Kratos.DisplacementCriteria(1e-14, 1e-16)
    )
    builder = Kratos.ResidualBasedBlockBuilderAndSolver(solver)
    strategy = Kratos.ResidualBasedNewtonRaphsonStrategy(part, scheme, criterion, builder, 30, True, False, True)
    strategy.SetEchoLevel(0)
    return strategy


def solve(scene: dict[str, Any]) -> list[tuple[float, float]]:
    """Return displacement and force of the driven nodes after every increment."""
    model = Kratos.Model()
    part = model_part(model, scene)
    strategy = strategy_of(part, scene["tolerance"])
    strategy.Initialize()
    rows = []
    for step, displacement in enumerate(scene["displacements"], 1):
        part.CloneTimeStep(float(step))
        part.ProcessInfo[Kratos.STEP] = step
        for node in scene["driven"]:
            part.Nodes[node + 1].SetSolutionStepValue(DISPLACEMENTS[scene["axis"]], displacement)
        strategy.InitializeSolutionStep()
        if step == 1:  # the law takes the element's stress, which is zero, when it is first called
            for element in part.Elements:
                points = len(element.GetIntegrationPoints())
                stress = [Kratos.Vector(scene["stress"])] * points
                element.SetValuesOnIntegrationPoints(Kratos.CAUCHY_STRESS_VECTOR, stress, points, part.ProcessInfo)
        strategy.Predict()
        if not strategy.SolveSolutionStep():
            raise SystemExit(f"increment {step} did not converge")
        strategy.FinalizeSolutionStep()
        forces = [part.Nodes[node + 1].GetSolutionStepValue(REACTIONS[scene["axis"]]) for node in scene["driven"]]
        rows.append((displacement, sum(forces)))
    return rows


if __name__ == "__main__":
    Kratos.Logger.GetDefaultOutput().SetSeverity(Kratos.Logger.Severity.WARNING)
    found = solve(json.loads(Path(sys.argv[1]).read_text(encoding="utf-8")))
    with Path(sys.argv[2]).open("w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows([("displacement", "force"), *found])
