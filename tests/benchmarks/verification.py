"""Write the table of docs/verification.md: ``python tests/benchmarks/verification.py [NAME ...]``.

Every problem of `fabfem verify` is run, or those named, whose tables alone are then replaced.
"""

import sys
from time import perf_counter

from page import write_table

from fabfem.verification.problems import chosen, rows
from fabfem.verification.report import cells

HEAD = (
    "| what | reference | got | error | allowed | time | verdict | how, or why not |\n|---|---|---|---|---|---|---|---|"
)


def main(names: list[str]) -> None:
    """Run problems and replace their tables in the page."""
    for name, problem in chosen(names).items():
        start = perf_counter()
        found = list(rows(problem))
        lines = [HEAD, *("| " + " | ".join(cells(row)) + " |" for row in found)]
        green = sum(row.green for row in found)
        lines.append(f"\n{green} of {len(found)} green, {perf_counter() - start:.0f} s.")
        write_table("verification.md", name, lines)
        print(f"{name}: {green} of {len(found)} green")


if __name__ == "__main__":
    main(sys.argv[1:])
