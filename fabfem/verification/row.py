"""A row of the table that `fabfem verify` prints: what was asked, what came out, and the verdict."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Row:
    """One comparison of an answer with its reference.

    Attributes
    ----------
    name : str
        What is compared.
    reference : float
        The known answer.
    got : float or None
        What came out; None where nothing did.
    tolerance : float
        Largest relative error that is green.
    seconds : float
        Wall time of the run behind the row; zero where another row of the same run has it.
    note : str
        How it was computed, or why nothing came out.
    """

    name: str
    reference: float
    got: float | None
    tolerance: float
    seconds: float = 0.0
    note: str = ""

    @property
    def error(self) -> float | None:
        """(got - reference) / reference, or None where there is no answer."""
        return None if self.got is None else (self.got - self.reference) / self.reference

    @property
    def green(self) -> bool:
        """Whether the error is within the tolerance."""
        return self.error is not None and abs(self.error) <= self.tolerance

    @property
    def verdict(self) -> str:
        """``green`` or ``red``."""
        return "green" if self.green else "red"
