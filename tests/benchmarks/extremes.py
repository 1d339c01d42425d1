"""Write the tables of docs/extremes.md: ``python tests/benchmarks/extremes.py [GROUP ...]``.

Every group of `fabfem stress` is run, or those named, whose tables alone are then replaced.
"""

import sys
from pathlib import Path

from fabfem.extremes.report import cells, chosen, headings, run

PAGE = Path(__file__).parents[2] / "docs" / "extremes.md"


def main(names: list[str]) -> None:
    """Run groups and replace their tables in the page."""
    for name in chosen(names):
        found = list(run(name))
        columns = headings(name)
        lines = ["| " + " | ".join(columns) + " |", "|" + "---|" * len(columns)]
        lines += ["| " + " | ".join(cells(row)) + " |" for row in found]
        green = sum(row.green for row in found)
        lines.append(f"\n{green} of {len(found)} green, {sum(row.seconds for row in found):.0f} s.")
        page = PAGE.read_text(encoding="utf-8")
        before, mark, rest = page.partition(f"<!-- {name} -->\n")
        assert mark, f"docs/extremes.md has no place for {name}"
        _, end, after = rest.partition("<!-- end -->")
        PAGE.write_text(before + mark + "\n".join([*lines, end]) + after, encoding="utf-8")
        print(f"{name}: {green} of {len(found)} green")


if __name__ == "__main__":
    main(sys.argv[1:])
