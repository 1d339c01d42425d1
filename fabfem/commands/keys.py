"""The command that prints the keys of a case: as lines for the terminal, or as the page docs/keys.md."""

import argparse
from collections.abc import Iterator, Sequence
from itertools import groupby
from textwrap import indent
from typing import TYPE_CHECKING

from fabfem.commands.status import BAD_INPUT, DONE, fail

if TYPE_CHECKING:
    from fabfem.case.keys import Key, Keys

TITLES = {
    ("boundary_value",): 'Boundary-value scenes, `kind = "boundary_value"`',
    ("element",): 'Element tests, `kind = "element"`',
    ("fabric",): 'Scenes on fabric laws, `kind = "fabric"`',
}
HEAD = """# Keys of a case

What `fabfem keys --markdown` prints, read off the tables that read a case; `fabfem keys PLACE`, such as
`fabfem keys stage.control`, shows a part of it. A key is needed where nothing stands under *left out*; – is absence,
which leaves the thing out of the scene. Names that are the user's choice are written NAME.
"""
COLUMNS = ("key", "value", "left out", "")


def add_commands(commands: argparse._SubParsersAction, common: argparse.ArgumentParser) -> None:
    """Add the command to those of a parser."""
    keys = commands.add_parser("keys", parents=[common], help="print the keys of a case and what they may be")
    keys.add_argument("place", nargs="?", default="", metavar="PLACE", help="a table, such as mesh or stage.control")
    keys.add_argument("--markdown", action="store_true", help="as a page of the documentation")
    keys.set_defaults(command=_keys)


def _keys(options: argparse.Namespace) -> int:
    from fabfem.case import suggest
    from fabfem.case.keys import keys

    found = keys(options.place)
    if not found:
        places = {table.place.strip("[]") for table in keys()} - {""}
        return fail(f"a case has no table '{options.place}'{suggest(options.place, places)}", BAD_INPUT)
    if not options.quiet:
        names = list(_names()) if options.markdown or not options.place else []
        print(page(found, names) if options.markdown else text(found, names))
    return DONE


def _names() -> Iterator[tuple[str, Sequence[str]]]:
    """Yield places whose values are names, and the names there are."""
    import umat
    from fabfem.boundary_value.fields import AT_NODES, OF_MOTION, OF_STRESS, PORE_PRESSURE
    from fabfem.laboratory.columns import MEASURES
    from umat.directions import NAMES, directions
    from umat.fabric import LAWS, PLANAR_LAWS
    from umat.mandel import IDENTITY
    from umat.sands import SANDS

    sand = SANDS["toyoura"]()
    state = umat.initial_state(sand, directions("bazant_oh_21"), 100.0 * IDENTITY[None], void_ratio=0.8)
    yield "material.NAME.preset", tuple(SANDS)
    yield "material.NAME.directions", NAMES
    yield "material.NAME.fabric.law", tuple(LAWS)
    yield "law.NAME.law", (*LAWS, *PLANAR_LAWS)
    fields = (*AT_NODES, *OF_MOTION, *OF_STRESS, *umat.state_fields(sand, state), PORE_PRESSURE)
    yield "output.fields", fields
    yield "output.measures", tuple(MEASURES)


def text(tables: "list[Keys]", names: list[tuple[str, Sequence[str]]]) -> str:
    """Return tables as lines for a terminal."""
    found = []
    for table in tables:
        head = "  ".join(word for word in (table.place or "at the head", table.kind) if word)
        lines = [f"{key.name} : {key.value}{_default(key)}\n{indent(key.what, '    ')}" for key in table.keys]
        found.append("\n".join([head, *([table.what] if table.what else []), *(indent(line, "  ") for line in lines)]))
    found += [f"{place}\n  {', '.join(known)}" for place, known in names]
    return "\n\n".join(found)


def page(tables: "list[Keys]", names: list[tuple[str, Sequence[str]]]) -> str:
    """Return tables as a page in Markdown."""
    found = [HEAD]
    for scenes, part in groupby(sorted(tables, key=lambda table: -len(table.scenes)), lambda table: table.scenes):
        found.append(f"## {TITLES.get(scenes, 'Every scene')}\n")
        for place, kinds in groupby(part, lambda table: table.place):
            found.append(f"### {f'`{place}`' if place else 'At the head'}\n")
            found += [section for table in kinds for section in _section(table)]
    found.append("## Names\n\n| key | names |\n|---|---|")
    return "\n".join(
        [*found, *(f"| `{place}` | {', '.join(f'`{name}`' for name in known)} |" for place, known in names)]
    )


def _section(table: "Keys") -> Iterator[str]:
    what = " ".join(word for word in (f"**`{table.kind}`**" if table.kind else "", table.what) if word)
    if what:
        yield f"{what}\n"
    if table.keys:
        yield f"| {' | '.join(COLUMNS)} |\n{'|---' * len(COLUMNS)}|"
        for key in table.keys:
            default = f"`{key.default}`" if key.default.strip("–") else key.default
            yield f"| `{key.name}` | {key.value} | {default} | {key.what} |"
        yield ""


def _default(key: "Key") -> str:
    if not key.default:
        return ", needed"
    return "" if key.default == "–" else f", else {key.default}"
