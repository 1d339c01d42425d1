"""Tables that benchmarks write into the pages of `docs`, between `<!-- NAME -->` and `<!-- end -->`."""

from collections.abc import Iterable
from pathlib import Path

DOCS = Path(__file__).parents[2] / "docs"
END = "<!-- end -->"


def write_table(page: str, name: str, lines: Iterable[str]) -> None:
    """Put lines in the place of what stands under a name in a page; AssertionError where it has no such place."""
    path, begin = DOCS / page, f"<!-- {name} -->\n"
    before, mark, rest = path.read_text(encoding="utf-8").partition(begin)
    _, end, after = rest.partition(END)
    assert mark, f"docs/{page} has no place for {name}"
    assert end, f"the place for {name} in docs/{page} has no end"
    path.write_text(before + begin + "\n".join([*lines, END]) + after, encoding="utf-8")
