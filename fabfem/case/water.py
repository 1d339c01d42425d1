"""What a case may say about the water in its pores."""

from pydantic import Field

from fabfem.case.table import Positive, Table


class Water(Table):
    """The water in the pores; a scene without this table is dry."""

    unit_weight: Positive
    """Unit weight of water."""
    level: float | None = Field(default=None)
    """Height of the water table; below it the pressure is hydrostatic and the soil has its saturated weight."""
    excess: bool = False
    """Whether pressures in excess of the hydrostatic ones are unknowns of the scene."""
    bulk_modulus: Positive | None = None
    """Bulk modulus of water; incompressible when left out [stress]."""
