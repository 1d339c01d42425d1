"""How exact an iterative solve has to be for the Newton iteration that it serves [Eisenstat & Walker 1996, choice 2].

A correction that leaves the part ρ of the out-of-balance force is followed by one that will leave about ρ² of what is
left, if Newton's iteration contracts as it should; a linear solve that is more exact than this is in vain. Factor and
exponent are γ = 1/2 and α = 2. The bounds keep a first correction from being crude and a last one from being asked
what round-off does not allow.
"""

GAMMA, LEAST, MOST = 0.5, 1e-8, 1e-3
"""Factor and bounds of the tolerance."""


def forcing(size: float, last: float) -> float:
    """Return the relative residual that is asked of a linear solve.

    Parameters
    ----------
    size : float
        Norm of the out-of-balance force to be solved for.
    last : float
        That of the solve before; 0 where there was none.
    """
    left = size / last if last else 1.0
    return min(max(GAMMA * left**2, LEAST), MOST)
