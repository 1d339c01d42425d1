"""What an element case may say: one point of soil in a laboratory, led through stages (`fabfem.case.paths`)."""

from collections import Counter
from collections.abc import Iterator
from typing import Annotated, Any, Literal

from pydantic import Field, field_validator, model_validator

from fabfem.case.materials import ChangHicher
from fabfem.case.paths import AnyElementStage, Path, Six, exactly_one
from fabfem.case.schema import AnyScene, Case
from fabfem.case.table import Identifier, NotNegative, Positive, Table, suggest

DIRECTIONS = "gauss_16x20"
"""Rule of contact directions where the case names none: one point can afford what a body cannot (docs/study.md)."""


class Scene(AnyScene):
    """A laboratory at one point."""

    kind: Literal["element"]
    """Kind of scene."""


class Initial(Table):
    """The state at the start; the material's void ratio and fabric are those under this stress."""

    p: Positive | None = None
    """Isotropic effective stress [stress]."""
    stress: Six | None = None
    """Effective stress xx, yy, zz, yz, xz, xy instead [stress]."""

    @model_validator(mode="after")
    def _given(self) -> "Initial":
        exactly_one(self, "p", "stress")
        return self


class Accuracy(Table):
    """How well the curves are to be resolved."""

    curve: Annotated[float, Field(gt=0, le=0.1)] = 0.005
    """Relative error of stress and strain along a curve."""


class Roses(Table):
    """Directional distributions to store."""

    stage: Identifier | None = None
    """Stage they are taken in; the last path when left out."""
    strain: Annotated[tuple[NotNegative, ...], Field(min_length=1, strict=False)] | None = None
    """Deviatoric strains at whose first row they are taken."""
    increments: Annotated[tuple[Annotated[int, Field(ge=0)], ...], Field(min_length=1, strict=False)] | None = None
    """Increments of the stage, instead; 0 is its start."""
    plane: Literal["zx", "zy", "xy"] = "zx"
    """Plane of the diagrams; the first axis is at 0 degrees."""

    @model_validator(mode="after")
    def _given(self) -> "Roses":
        exactly_one(self, "strain", "increments")
        return self


class Output(Table):
    """What is stored besides stress and strain."""

    measures: Annotated[tuple[str, ...], Field(strict=False)] = ("p", "q", "eta", "eps_v", "eps_q")
    """Measures, a column of the history each."""
    e_A: float | None = None  # noqa: N815 - the symbol of the source
    """Weight of the fabric in the dilatancy state parameter zeta (e_A)."""
    A_c: Positive | None = None
    """Anisotropy in the critical state that zeta refers to (A_c); the fabric law's own when left out."""
    roses: Roses | None = None
    """Directional distributions to store."""


class ElementCase(Case):
    """An element test as its file states it."""

    scene: Scene
    """What is solved."""
    initial: Initial
    """The state at the start."""
    stage: Annotated[tuple[AnyElementStage, ...], Field(min_length=1, strict=False)]
    """Stages, in order."""
    accuracy: Accuracy = Accuracy()
    """How well the curves are to be resolved."""
    output: Output = Output()
    """What is stored besides stress and strain."""

    @field_validator("material")
    @classmethod
    def _with_directions(cls, material: dict[str, Any]) -> dict[str, Any]:
        return {name: _finer(table) for name, table in material.items()}


def _finer(table: Any) -> Any:
    """Return a material with the element test's rule of directions where it names none."""
    if isinstance(table, ChangHicher) and "directions" not in table.model_fields_set:
        return table.model_copy(update={"directions": DIRECTIONS})
    return table


def contradictions(case: ElementCase) -> Iterator[tuple[str, str]]:
    """Yield (place, what) for what no single table can see."""
    if len(case.material) > 1:
        yield "material", f"an element has one material, here are {len(case.material)}"
    for name, count in Counter(stage.name for stage in case.stage).items():
        if count > 1:
            yield "stage", f"the name '{name}' is given {count} times"
    paths = [stage.name for stage in case.stage if isinstance(stage, Path)]
    roses: Any = case.output.roses
    if roses and not paths:
        yield "output.roses", "needs a stage that is a path"
    if roses and roses.stage is not None and roses.stage not in paths:
        yield "output.roses.stage", f"there is no path '{roses.stage}'{suggest(roses.stage, paths)}"
    for name, table in case.material.items():
        if table.zones is not None:
            yield f"material.{name}.zones", "an element has no zones"
