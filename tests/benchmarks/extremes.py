"""Write the tables of docs/extremes.md: ``python tests/benchmarks/extremes.py [GROUP ...]``.

Every group of `fabfem stress` is run, or those named, whose tables alone are then replaced.
"""

import sys

from page import write_table

from fabfem.extremes.report import cells, chosen, headings, run


def main(names: list[str]) -> None:
    """Run groups and replace their tables in the page."""
    for name in chosen(names):
        found = list(run(name))
        columns = headings(name)
        lines = ["| " + " | ".join(columns) + " |", "|" + "---|" * len(columns)]
        lines += ["| " + " | ".join(cells(row)) + " |" for row in found]
        green = sum(row.green for row in found)
        lines.append(f"\n{green} of {len(found)} green, {sum(row.seconds for row in found):.0f} s.")
        write_table("extremes.md", name, lines)
        print(f"{name}: {green} of {len(found)} green")


if __name__ == "__main__":
    main(sys.argv[1:])
