"""What a case may say about runs of itself with other numbers: sweeps, studies of error and time, calibrations.

A **place** is a path into the case as the messages about it write it, ``stage[settlement].increments.maximum``: entries
of a list are called by their name, or counted from 1. None of these tables changes the run of the case itself.
"""

from typing import Annotated, Literal

from pydantic import Field, model_validator

from fabfem.case.table import Identifier, Names, NotNegative, Positive, SomeNames, Table, Text, suggest

Scalar = bool | int | float | str
Value = Annotated[Scalar | Annotated[tuple[Scalar, ...], Field(strict=False)], Field(union_mode="smart")]
"""A value that a variant of the case has at a place."""

Values = Annotated[tuple[Value, ...], Field(min_length=1, strict=False)]


class Parameter(Table):
    """A named parameter with the values that it takes."""

    name: Text
    """Name of its column."""
    at: Names
    """Place in the case, or places, that have the value."""
    values: Values
    """Values that it takes."""
    set: dict[str, Value] = Field(default={})
    """Values by place that go with all of them."""
    along: dict[str, Values] = Field(default={})
    """Values by place, one for each of `values`, that go with it."""
    labels: Names | None = None
    """Names of the values in tables and pictures; the values when left out, with those along where two are equal."""

    @model_validator(mode="after")
    def _as_many(self) -> "Parameter":
        for place, values in self.along.items():
            if len(values) != len(self.values):
                raise ValueError(f"has {len(self.values)} values, but {len(values)} along with them for {place}")
        return self

    @model_validator(mode="after")
    def _listed(self) -> "Parameter":
        if self.labels is not None and len(self.labels) != len(self.values):
            raise ValueError(f"has {len(self.values)} values and {len(self.labels)} labels")
        return self


class Runs(Table):
    """How many runs go on at once."""

    workers: Annotated[int, Field(ge=0)] = 0
    """Processes at once, fewer where memory is short; 0 takes one for each core."""
    memory: NotNegative = 0.0
    """Memory that all of them may take together [MiB]; 0 is what the machine has free."""


class Reading(Table):
    """A number of the history, met where another column passes a value."""

    column: Text
    """Column, without its unit."""
    value: float
    """Value of that column, which is interpolated between rows."""


class Axis(Table):
    """A column of the measured data and the column of the history that answers it."""

    data: Text
    """Column of the data."""
    history: Text
    """Column of the history, without its unit."""
    divide_by: Text | None = None
    """Column of the history to divide by, such as the other stress of a ratio."""
    scale: float = 1.0
    """Factor on the column of the history, such as 100 for per cent."""
    error: Positive = 1.0
    """Size of an error that counts as one, in the units of the data."""


class Comparison(Table):
    """Measured curves, and what answers them."""

    data: Text
    """CSV file of the measured data, relative to the case file; lines that start with # are passed over."""
    over: Axis
    """Abscissa along which the curves are compared."""
    curve: Annotated[tuple[Axis, ...], Field(min_length=1, strict=False)]
    """Ordinates that are compared."""
    stage: Text | None = None
    """Stage whose rows count; all when left out."""


class MeasuredRuns(Comparison):
    """Measured curves beside those of a sweep."""

    where: Annotated[dict[Text, Text], Field(min_length=1)]
    """Parameter of the sweep whose value a column of the data has in the rows that belong to a run."""


class Exponential(Table):
    """A curve y = factor exp(rate x) of a source."""

    name: Text
    """Name in the picture."""
    x: Text | None = None
    """Column across of the panel that it belongs to; all panels when left out."""
    factor: float
    """Value at x = 0."""
    rate: float
    """Exponent over x."""


class SweptPicture(Table):
    """A picture of all runs of a sweep: columns of their histories, or the states that they pass.

    A sweep that has none, and no measured curves, is drawn with its columns over the first one, or, where only the last
    rows are kept, over the first parameter.
    """

    name: Identifier
    """Name of the file."""
    x: Names
    """Column across; a list makes a panel of each entry."""
    y: Names
    """Column upwards; a list as long as that of x."""
    colour: Text | None = None
    """Parameter whose values have colours; the first when left out."""
    style: Text | None = None
    """Parameter whose values have styles of line."""
    until: Reading | None = None
    """Rows of a run after the first that passes this value are left out."""
    states: SomeNames = ()
    """States to draw as points, by their names in the report, with the best exponential through all of them."""
    curves: Annotated[tuple[Exponential, ...], Field(strict=False)] = ()
    """Curves to draw with the states."""

    @model_validator(mode="after")
    def _paired(self) -> "SweptPicture":
        if len(self.x) != len(self.y):
            raise ValueError(f"x and y must be lists of one length (got {len(self.x)} and {len(self.y)})")
        return self


class Sweep(Runs):
    """The product of some parameters."""

    parameter: Annotated[tuple[Parameter, ...], Field(min_length=1, strict=False)]
    """Parameters, the last of which changes fastest."""
    rows: Literal["last", "all"] = "last"
    """Rows of each history that go into the table."""
    columns: Names | None = None
    """Columns of the history that go into the table; all when left out."""
    measured: MeasuredRuns | None = None
    """Measured curves that the runs are compared with."""
    picture: Annotated[tuple[SweptPicture, ...], Field(strict=False)] = ()
    """Pictures of all runs."""

    @model_validator(mode="after")
    def _named(self) -> "Sweep":
        known = [parameter.name for parameter in self.parameter]
        asked = [name for picture in self.picture for name in (picture.colour, picture.style) if name is not None]
        for name in (*asked, *(self.measured.where.values() if self.measured else ())):
            if name not in known:
                raise ValueError(f"there is no parameter '{name}'{suggest(name, known)}")
        for picture in self.picture:
            if not picture.states and self.rows != "all":
                raise ValueError(f"picture '{picture.name}' draws whole histories and needs rows = 'all'")
        return self


class Quantity(Table):
    """The quantity of interest, taken from the history of a run."""

    column: Text
    """Column, without its unit."""
    take: Literal["last", "largest", "smallest", "at", "curve"] = "last"
    """What of the column: its last, largest or smallest value, that at a reading, or all of it over another."""
    at: Reading | None = None
    """Where it is read, for ``at``."""
    over: Text | None = None
    """Column along which a curve is compared."""
    stage: Text | None = None
    """Stage whose rows count; all when left out."""

    @model_validator(mode="after")
    def _complete(self) -> "Quantity":
        for take, key in (("at", "at"), ("curve", "over")):
            if (self.take == take) != (getattr(self, key) is not None):
                raise ValueError(f"take = '{take}' and '{key}' need each other")
        return self


class Truth(Table):
    """What the quantity truly is; without this table a fine run says it, with every knob at its last value."""

    exact: float | None = None
    """The exact answer."""
    richardson: Text | None = None
    """Knob along which the finest runs are extrapolated."""
    reference: dict[str, Value] | None = None
    """Values by place of a run fine enough to count as true."""

    @model_validator(mode="after")
    def _one(self) -> "Truth":
        given = [key for key in ("exact", "richardson", "reference") if getattr(self, key) is not None]
        if len(given) != 1:
            raise ValueError("needs one of exact, richardson and reference")
        return self


class Knob(Parameter):
    """A setting that costs time and buys accuracy, with values from coarse to fine."""

    order: Positive | None = None
    """Expected order: the error falls with this power of the size."""
    sizes: Annotated[tuple[Positive, ...], Field(strict=False)] | None = None
    """Size that goes with each value; the values themselves when left out."""

    @model_validator(mode="after")
    def _sized(self) -> "Knob":
        if self.sizes is not None and len(self.sizes) != len(self.values):
            raise ValueError(f"has {len(self.values)} values and {len(self.sizes)} sizes")
        numbers = all(isinstance(value, int | float) and not isinstance(value, bool) for value in self.values)
        if self.order is not None and self.sizes is None and not numbers:
            raise ValueError("an order needs numbers as values, or sizes")
        return self


class Study(Runs):
    """Error against run time."""

    quantity: Quantity
    """Quantity of interest."""
    truth: Truth | None = None
    """What it truly is."""
    knob: Annotated[tuple[Knob, ...], Field(min_length=1, strict=False)]
    """Settings that are turned."""
    turn: Literal["one_at_a_time", "product"] = "one_at_a_time"
    """Each knob alone with the others as the case has them, or all combinations."""
    repeat: Annotated[int, Field(ge=1)] = 3
    """Timings of each run, of which the median counts."""
    clock: Literal["wall", "cpu"] = "wall"
    """Time that counts: that of the clock on the wall, or that which the processors spent on the run."""


class Fitted(Table):
    """A parameter that is fitted, between bounds."""

    name: Text
    """Name in the results."""
    at: Names
    """Place in the case, or places, that have the value."""
    start: float
    """First guess."""
    lower: float
    """Lower bound."""
    upper: float
    """Upper bound."""
    scale: Literal["linear", "logarithmic"] = "linear"
    """Whether the parameter or its logarithm is fitted."""

    @model_validator(mode="after")
    def _bounded(self) -> "Fitted":
        if not self.lower < self.start < self.upper:
            raise ValueError(f"must satisfy lower < start < upper (got {self.lower:g}, {self.start:g}, {self.upper:g})")
        if self.scale == "logarithmic" and self.lower <= 0.0:
            raise ValueError(f"a logarithmic scale needs a lower bound above 0 (got {self.lower:g})")
        return self


class Measured(Table):
    """A measured test: its rows of the data, and the case that repeats it."""

    where: dict[str, Scalar] = Field(default={})
    """Rows of the data that belong to it, by the value of a column."""
    set: dict[str, Value] = Field(default={})
    """Values by place that the case has for this test."""


class Calibration(Comparison, Runs):
    """A least-squares fit of parameters to measured curves."""

    test: Annotated[tuple[Measured, ...], Field(min_length=1, strict=False)]
    """Tests that are fitted together."""
    parameter: Annotated[tuple[Fitted, ...], Field(min_length=1, strict=False)]
    """Parameters that are fitted."""
    tolerance: Positive = 1e-3
    """Change of the parameters, over the distance of their bounds, at which the fit is done."""
    step: Positive = 0.01
    """Step of the derivatives, over the distance of the bounds; larger than what the runs' own errors blur."""
    evaluations: Annotated[int, Field(ge=1)] = 30
    """Most sets of parameters tried, besides those of the derivatives."""
