"""What a boundary-value case may say."""

from typing import Annotated, Literal

from pydantic import Field

from fabfem.case.schema import AnyScene, Case
from fabfem.case.stages import AnyStage, Component, Support
from fabfem.case.table import Factors, Identifier, Names, NotNegative, Positive, Table, Text


class Scene(AnyScene):
    """A boundary-value problem."""

    kind: Literal["boundary_value"]
    """Kind of scene."""
    kinematics: Literal["plane_strain", "axisymmetric", "axisymmetric_torsion", "solid"]
    """Displacements that the scene has, and the strains they make."""


class Mesh(Table):
    """The mesh."""

    file: Text
    """File in any format of meshio, with named boundaries and zones; relative to the case file."""
    order: Annotated[int, Field(ge=1, le=2)] = 2
    """Order of the displacement in an element."""
    volume_strain: Literal["pointwise", "mean"] | None = None
    """Volume strain of each point, or its mean over patches of elements; the mean when left out and the order is 1."""
    points: Annotated[int, Field(ge=1)] | None = None
    """Integration points of an element; its usual number when left out."""


class Solver(Table):
    """Solution of the equilibrium equations."""

    tolerance: Positive = 1e-6
    """Largest out-of-balance force over the size of the forces in play."""
    iterations: Annotated[int, Field(ge=1)] = 16
    """Most iterations of an increment before it is cut."""
    viscosity: NotNegative = 0.0
    """Stress that resists the rate of strain, over the elastic stress of the same strain in one stage."""
    held: Annotated[float, Field(ge=0, le=1)] = 0.0
    """Share of the points that may keep their stress in an increment where the material refuses them."""
    linear: Literal["auto", "superlu", "pardiso"] = "auto"
    """Linear solver; auto takes PARDISO where it is installed."""
    threads: Annotated[int, Field(ge=0)] = 0
    """Threads for the material points; 0 takes the cores there are."""


class Probe(Table):
    """A displacement written to the history."""

    name: Identifier
    """Name of the column."""
    kind: Literal["displacement"] = "displacement"
    """What is probed."""
    boundary: Names | None = None
    """Boundaries over whose nodes the mean is taken."""
    point: Annotated[tuple[float, ...], Field(min_length=2, max_length=3, strict=False)] | None = None
    """Point whose nearest node is taken, instead of a boundary."""
    component: Component
    """Component of the displacement."""
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


class Output(Table):
    """What is stored besides the history."""

    fields: Annotated[tuple[Identifier, ...], Field(min_length=1, strict=False)]
    """Fields to compute and store."""
    every: Annotated[int, Field(ge=1)] = 1
    """Store every so many increments; the end of a stage is always stored."""
    at: Annotated[tuple[Literal["nodes", "cells"], ...], Field(min_length=1, strict=False)] = ("nodes", "cells")
    """Smoothed at nodes, raw means in cells, or both."""


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
    solver: Solver = Solver()
    """Solution of the equations."""
    probe: Annotated[tuple[Probe, ...], Field(strict=False)] = ()
    """Displacements to record."""
    reaction: Annotated[tuple[Reaction, ...], Field(strict=False)] = ()
    """Forces to record."""
    derived: Annotated[tuple[Derived, ...], Field(strict=False)] = ()
    """Columns made from others."""
    output: Output | None = None
    """Fields to store; none when left out."""
