"""What is odd about a case although it can be run: said with its answer, for it may be what explains it."""

from collections.abc import Iterator

from fabfem.case import Case
from fabfem.case.materials import ChangHicher


def remarks(case: Case) -> Iterator[str]:
    """Yield a sentence for each thing in a case that lies outside what is known of it."""
    from umat.sands import PACKINGS

    for name, said in getattr(case, "material", {}).items():
        if isinstance(said, ChangHicher) and said.preset in PACKINGS:
            densest, loosest = PACKINGS[said.preset]
            if not densest <= said.void_ratio <= loosest:
                beyond = "denser than the densest" if said.void_ratio < densest else "looser than the loosest"
                limit = densest if said.void_ratio < densest else loosest
                yield (
                    f"material.{name}.void_ratio: {said.void_ratio:g} is {beyond} packing of this sand, {limit:g}; "
                    "nothing was measured there"
                )
