"""What a boundary-value case may say."""

from typing import Annotated, Literal

from pydantic import Field

from fabfem.case.mesh import Mesh
from fabfem.case.schema import AnyScene, Case
from fabfem.case.stages import AnyStage, Component, Support
from fabfem.case.table import Factors, Identifier, Names, NotNegative, Table, Text
from fabfem.case.water import Water


class Scene(AnyScene):
    """A boundary-value problem."""

    kind: Literal["boundary_value"]
    """Kind of scene."""
    kinematics: Literal["plane_strain", "axisymmetric", "axisymmetric_torsion", "solid"]
    """Displacements that the scene has, and the strains they make."""


class Solver(Table):
    """Solution of the equilibrium equations."""

    tolerance: Annotated[float, Field(gt=0, le=0.1)] = 1e-6
    """Largest out-of-balance force over the size of the forces in play."""
    iterations: Annotated[int, Field(ge=1)] = 16
    """Most iterations of an increment before it is cut."""
    viscosity: NotNegative = 0.0
    """Stress that resists the rate of strain, over the elastic stress of the same strain in one stage."""
    held: Annotated[float, Field(ge=0, le=1)] = 0.0
    """Share of the points that may keep their stress in an increment where the material refuses them."""
    linear: Literal["auto", "superlu", "pardiso", "mumps", "multigrid"] = "auto"
    """Linear solver; auto takes multigrid for large solids, else PARDISO where it is installed, and MUMPS where several
    processes share the run."""
    petsc: dict[str, str | int | float | bool] = Field(default_factory=dict)
    """Options of PETSc, without the leading dash, where it solves: mumps, several processes, multigrid with options."""
    threads: Annotated[int, Field(ge=0)] = 0
    """Threads for the material points; 0 takes the cores there are."""
    diagnose: bool = False
    """Whether condition number and pivot growth of the stiffness are recorded after every increment."""


class Probe(Table):
    """A displacement, or a pore pressure, written to the history."""

    name: Identifier
    """Name of the column."""
    kind: Literal["displacement", "pore_pressure", "mean", "deviation"] = "displacement"
    """What is probed: at nodes, or the volume mean or standard deviation of a field."""
    boundary: Names | None = None
    """Boundaries over whose nodes the mean is taken."""
    point: Annotated[tuple[float, ...], Field(min_length=2, max_length=3, strict=False)] | None = None
    """Point whose nearest node is taken, instead of a boundary."""
    component: Component | None = None
    """Component of the displacement; a pore pressure has none."""
    field: Identifier | None = None
    """Field of the points whose mean or deviation is taken."""
    entry: Literal["xx", "yy", "zz", "yz", "xz", "xy"] | None = None
    """Entry of a field that is a tensor, along the axes of the mesh (about an axis: x = r, y = z, z = theta)."""
    zones: Names | None = None
    """Zones over which they are taken; all when left out."""
    scale: float = 1.0
    """Factor on the value."""


class Reaction(Table):
    """The force that a held boundary exerts on the soil, written to the history."""

    name: Identifier
    """Name of the column."""
    boundary: Names
    """Boundaries over which the force is summed."""
    component: Component
    """Component of the force."""
    scale: float = 1.0
    """Factor on the value, such as 2 for the other half of a symmetric scene."""


class Derived(Table):
    """A column of the history made from another one."""

    name: Text
    """Name of the column."""
    of: Identifier
    """Probe or reaction it is made from."""
    divide_by: Factors
    """Number, or numbers, to divide by."""
    unit: Text = "-"
    """Unit of the result."""


class HollowCylinder(Table):
    """A hollow cylinder whose averages are written to the history, as a laboratory has them and as volume means."""

    inner: Text
    """Boundary at the inner radius."""
    outer: Text
    """Boundary at the outer radius."""
    platen: Text
    """Boundary that carries the axial force and the torque; the opposite end does not move along or around the axis."""


class Output(Table):
    """What is stored besides the history."""

    fields: Annotated[tuple[Identifier, ...], Field(min_length=1, strict=False)]
    """Fields to compute and store."""
    every: Annotated[int, Field(ge=1)] = 1
    """Store every so many increments; the end of a stage is always stored."""
    at: Annotated[tuple[Literal["nodes", "cells"], ...], Field(min_length=1, strict=False)] = ("nodes", "cells")
    """Smoothed at nodes, raw means in cells, or both."""


class Errors(Table):
    """Estimates of its own error that a run carries, a column of the history each."""

    estimate: Annotated[
        tuple[Literal["equilibrium", "integration", "substeps", "discretisation", "directions"], ...],
        Field(min_length=1, strict=False),
    ]
    """What is estimated."""
    rule: Text = "lebedev_23"
    """Second rule of contact directions, with which the directions' error is estimated."""
    samples: Annotated[int, Field(ge=1)] = 16
    """Points of each zone that are followed a second time, with the second rule or a smaller tolerance."""


class BoundaryValueCase(Case):
    """A boundary-value problem as its file states it."""

    scene: Scene
    """What is solved."""
    mesh: Mesh
    """The mesh."""
    support: Annotated[tuple[Support, ...], Field(strict=False)] = ()
    """Supports of all stages."""
    stage: Annotated[tuple[AnyStage, ...], Field(min_length=1, strict=False)]
    """Stages, in order."""
    water: Water | None = None
    """Water in the pores; a scene without it is dry."""
    solver: Solver = Solver()
    """Solution of the equations."""
    probe: Annotated[tuple[Probe, ...], Field(strict=False)] = ()
    """Displacements to record."""
    reaction: Annotated[tuple[Reaction, ...], Field(strict=False)] = ()
    """Forces to record."""
    derived: Annotated[tuple[Derived, ...], Field(strict=False)] = ()
    """Columns made from others."""
    hollow_cylinder: HollowCylinder | None = None
    """Averages of a hollow cylinder to record; none when left out."""
    output: Output | None = None
    """Fields to store; none when left out."""
    errors: Errors | None = None
    """Errors to estimate; none when left out."""
