"""Stages: what a part of the run holds, moves and loads, and how finely it is stepped."""

from dataclasses import dataclass

from fabfem.fem.loads import Load
from fabfem.fem.supports import Support


@dataclass(frozen=True)
class Stage:
    """One part of a run. It holds only what it names: repeat fixities and gravity in every stage.

    Attributes
    ----------
    name : str
    supports : tuple of Support
        Held components of boundaries; a support's displacement is added in equal parts over the stage.
    loads : tuple of Load
        Each goes from its start to its end factor over the stage.
    first, largest, smallest : float
        Size of an increment, as a fraction of the stage: at first, at most, and where the run gives up.
    zero_displacement : bool
        Whether displacements count from zero again once the stage is done.
    duration : float
        Time that the stage takes.
    """

    name: str
    supports: tuple[Support, ...]
    loads: tuple[Load, ...] = ()
    first: float = 0.05
    largest: float = 0.05
    smallest: float = 1e-4
    zero_displacement: bool = False
    duration: float = 1.0

    def __post_init__(self) -> None:
        """Refuse sizes that cannot step through the stage."""
        if not 0.0 < self.smallest <= self.first <= self.largest <= 1.0:
            raise ValueError(f"stage '{self.name}' needs 0 < smallest <= first <= largest <= 1 for its increments.")
