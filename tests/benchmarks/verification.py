"""Write the table of docs/verification.md: ``python tests/benchmarks/verification.py [NAME ...]``.

Every problem of `fabfem verify` is run, or those named, whose tables alone are then replaced.
"""

import sys
from pathlib import Path
from time import perf_counter

from fabfem.verification.problems import chosen, rows
from fabfem.verification.report import cells

PAGE = Path(__file__).parents[2] / "docs" / "verification.md"
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
        page = PAGE.read_text(encoding="utf-8")
        before, start_mark, rest = page.partition(f"<!-- {name} -->\n")
        assert start_mark, f"docs/verification.md has no place for {name}"
        _, end_mark, after = rest.partition("<!-- end -->")
        PAGE.write_text(before + start_mark + "\n".join([*lines, end_mark]) + after, encoding="utf-8")
        print(f"{name}: {green} of {len(found)} green")


if __name__ == "__main__":
    main(sys.argv[1:])
