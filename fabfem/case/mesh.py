"""What a case may say about its mesh: a file, a box cut into equal cells, or a script that draws it."""

from typing import Annotated, Literal

from pydantic import Field, model_validator

from fabfem.case.table import Identifier, Positive, Table, Text

Corner = Annotated[tuple[float, ...], Field(min_length=2, max_length=3, strict=False)]
Counts = Annotated[tuple[Annotated[int, Field(ge=1)], ...], Field(min_length=2, max_length=3, strict=False)]


class Box(Table):
    """A box with sides left, right, bottom and top (solids: front and back too), all of it the zone "all"."""

    lower: Corner
    """Corner with the smallest coordinates [length]."""
    upper: Corner
    """Corner with the largest coordinates [length]."""
    cells: Counts | None = None
    """Cells along each axis."""
    size: Positive | None = None
    """Size of a cell instead of their number, kept as nearly as whole cells allow [length]."""
    shape: Literal["triangle", "quad", "tetra", "hexahedron"] | None = None
    """Shape of an element; quadrilaterals or hexahedra when left out."""

    @model_validator(mode="after")
    def _fits(self) -> "Box":
        dim = len(self.lower)
        if (self.cells is None) == (self.size is None):
            raise ValueError("needs either cells or size")
        if len(self.upper) != dim or len(self.cells or self.lower) != dim:
            raise ValueError("needs as many numbers in lower, upper and cells")
        if any(low >= high for low, high in zip(self.lower, self.upper, strict=True)):
            raise ValueError("must have lower below upper along every axis")
        if (self.element in ("triangle", "quad")) != (dim == 2):
            raise ValueError(f"a {self.element} does not fill a box of {dim} axes")
        return self

    @property
    def element(self) -> str:
        """Shape of an element."""
        return self.shape or ("quad" if len(self.lower) == 2 else "hexahedron")

    @property
    def counts(self) -> tuple[int, ...]:
        """Cells along each axis."""
        if self.cells is not None:
            return self.cells
        assert self.size is not None
        return tuple(max(1, round((high - low) / self.size)) for low, high in zip(self.lower, self.upper, strict=True))


class Region(Table):
    """A box along the axes."""

    lower: Corner
    """Corner with the smallest coordinates [length]."""
    upper: Corner
    """Corner with the largest coordinates [length]."""

    @model_validator(mode="after")
    def _ordered(self) -> "Region":
        if len(self.lower) != len(self.upper):
            raise ValueError("needs as many numbers in lower and upper")
        if any(low > high for low, high in zip(self.lower, self.upper, strict=True)):
            raise ValueError("must not have lower above upper along any axis")
        return self


class Side(Region):
    """A part of a boundary: all its facets that lie in a box along the axes. The whole boundary stays what it is."""

    of: Text
    """Boundary that it is a part of."""


class Layer(Region):
    """A zone: all elements whose centre lies in a box along the axes. They leave the zones they were in."""


class Mesh(Table):
    """The mesh: one of a file, a box and a script."""

    file: Text | None = None
    """File in any format of meshio, with named boundaries and zones; relative to the case file."""
    box: Box | None = None
    """A box cut into equal cells."""
    script: Text | None = None
    """Python script that writes a mesh, called as ``python SCRIPT FILE name=value ...``; relative to the case file."""
    parameters: dict[Identifier, int | float | str] = Field(default={})
    """Names and values that the script is called with."""
    boundary: dict[Identifier, Side] = Field(default={})
    """Further boundaries by name, such as the strip under a footing."""
    zone: dict[Identifier, Layer] = Field(default={})
    """Further zones by name, such as a layer."""
    order: Annotated[int, Field(ge=1, le=2)] = 2
    """Order of the displacement in an element."""
    points: Annotated[int, Field(ge=1)] | None = None
    """Integration points of an element; the element's usual number when left out."""
    volume_strain: Literal["pointwise", "mean"] | None = None
    """Volume strain of each point, or its mean over patches of elements; the mean when left out and the order is 1."""

    @model_validator(mode="after")
    def _one(self) -> "Mesh":
        if [self.file, self.box, self.script].count(None) != 2:
            raise ValueError("needs one of file, box and script")
        if self.parameters and self.script is None:
            raise ValueError("has parameters and no script that reads them")
        return self
