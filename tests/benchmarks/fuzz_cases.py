"""Malformed case files: mutants of the shipped cases, each of which is refused with a sentence or runs as it should.

``python tests/benchmarks/fuzz_cases.py --count 2000 [--seed 1] [--solve 60] [--seconds 10]`` checks that many mutants
by ``fabfem check`` and solves some of those that are accepted, for a few seconds each. A mutant is a shipped case in
which one to three things are wrong: in its tables (a key left out, misspelt, moved or given twice; a value of another
type, sign or size, not finite, empty) or in its text (characters, lines, bytes, the end). It ends in one of these ways:

=================  ====================================================================================================
refused            status 2 and one line that names the file, or a place in it
accepted, same     the case with all its defaults is the one it was made from
accepted, other    another case, which says something possible
long               an answer takes more than a minute: the case asks for that much work, such as 100,000 records
fault              anything else: another status, a traceback, more than one line
=================  ====================================================================================================
"""

import argparse
import contextlib
import io
import math
import os
import random
import re
import resource
import shutil
import signal
import subprocess
import sys
import tomllib
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

from fabfem.case import CaseError, read_case, resolved
from fabfem.case.toml import write_toml
from fabfem.cli import main
from fabfem.commands.status import BAD_INPUT, DONE, INTERRUPTED, STOPPED
from fabfem.output.history import read_history

ROOT = Path(__file__).parents[2]
MEMORY = 8 * 2**30
"""Address space of a process [bytes]."""
UNTOLD = re.compile(r"(hgs_|mean_)?(b|alpha|lode|F_alpha|F_b|A|A_prime|zeta|K_F) \[")
"""Columns that an isotropic stress or fabric, which has no direction, leaves open."""
PATIENCE = 60
"""Time that a check may take [s]."""

NUMBERS = (0, -1, 1, 2, 7, 0.0, -0.0, 0.5, -0.5, 1e-300, -1e-3, 1e3, 1e9, 1e308, -1e308, 10**30, -(10**30))
OTHERS = (True, False, "", "x", "é∂", "all", " ", "a/b", "..", [], {}, [1.0], [[]], ["x", "x"], {"x": 1}, [{}])
NOT_FINITE = (math.nan, math.inf, -math.inf)
TEXTS = ("=", "[", "]", '"', "'", "#", "\n", ",", "{", "}", ".", "-", "1", "e", "\x00", "\t", "é", "[[stage]]\n", "=\n")


class Judged(NamedTuple):
    """What became of a mutant."""

    verdict: str
    """``refused``, ``accepted, same``, ``accepted, other``, ``long`` or ``fault``."""
    what: str
    """The line that was said, or what went wrong."""


def places(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Yield the path to every value in some tables."""
    entries = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, entry in entries:
        yield (*path, key)
        yield from places(entry, (*path, key))


def home_of(tables: Any, path: tuple[Any, ...]) -> Any:
    for key in path[:-1]:
        tables = tables[key]
    return tables


def tables_mutated(tables: dict[str, Any], chance: random.Random) -> None:
    """Do one wrong thing to some tables."""
    found = list(places(tables))
    if not found:
        return
    numbers = [path for path in found if type(home_of(tables, path)[path[-1]]) in (int, float)]
    path = chance.choice(numbers if numbers and chance.random() < 0.5 else found)
    home, key = home_of(tables, path), path[-1]
    other = chance.choice(found)
    what = chance.choice(["drop", "value", "number", "number", "misspell", "copy", "move", "scale", "scale", "repeat"])
    if what == "drop":
        del home[key]
    elif what == "misspell" and isinstance(key, str):
        place = chance.randrange(len(key) + 1)
        home[key[:place] + chance.choice("aeiou_") + key[place + 1 :]] = home.pop(key)
    elif what in ("copy", "move") and other[: len(path)] != path and path[: len(other)] != other:
        home[key] = home_of(tables, other)[other[-1]]
        if what == "move" and isinstance(other[-1], str):
            del home_of(tables, other)[other[-1]]
    elif what == "scale" and type(home[key]) in (int, float):
        home[key] = home[key] * chance.choice([-1, 0, 0.5, 2, 10, 1000, 1e-6])
    elif what == "repeat" and isinstance(home[key], list):
        home[key] = home[key] * chance.choice([2, 3])
    elif what == "number":
        home[key] = chance.choice(NUMBERS + NOT_FINITE)
    else:
        home[key] = chance.choice(OTHERS)


def text_mutated(text: str, chance: random.Random) -> str:
    """Return a text with one wrong thing in it."""
    lines = text.splitlines(keepends=True)
    at, line = chance.randrange(max(len(text), 1)), chance.randrange(max(len(lines), 1))
    ways: list[Callable[[], str]] = [
        lambda: text[:at] + text[at + chance.randrange(1, 4) :],
        lambda: text[:at] + chance.choice(TEXTS) + text[at:],
        lambda: text[:at],
        lambda: "".join(lines[:line] + lines[line + 1 :]),
        lambda: "".join([*lines[: line + 1], *lines[line:]]),
        lambda: "".join(chance.sample(lines, len(lines))),
        lambda: text.replace("=", chance.choice([":", "==", ""]), 1),
    ]
    return chance.choice(ways)()


def mutant(text: str, chance: random.Random) -> bytes:
    """Return the content of a mutant of a case."""
    if chance.random() < 0.3:
        for _ in range(chance.choice([1, 1, 2, 3])):
            text = text_mutated(text, chance)
        raw = text.encode()
        return raw.replace(b"a", b"\xff", 1) if chance.random() < 0.03 else raw
    tables = tomllib.loads(text)
    for _ in range(chance.choice([1, 1, 1, 2, 3])):
        tables_mutated(tables, chance)
    return write_toml(tables).encode()


def copied(folder: Path) -> list[Path]:
    """Copy the cases and starters, so that mutants find the files that they name, and return them."""
    shutil.copytree(ROOT / "cases", folder / "cases")
    shutil.copytree(ROOT / "fabfem" / "starters", folder / "cases" / "starters")
    (folder / "meshes").symlink_to(ROOT / "meshes")
    return sorted((folder / "cases").rglob("*.toml"))


def checked(file: Path, original: Path) -> Judged:
    """Return what ``fabfem check`` makes of a mutant."""
    out, err = io.StringIO(), io.StringIO()
    try:
        signal.alarm(PATIENCE)
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            status = main(["check", str(file)])
    except TooLongError:
        return Judged("long", "")
    except BaseException as error:  # whatever it is, it is a finding
        return Judged("fault", f"{type(error).__name__}: {error}")
    finally:
        signal.alarm(0)
    said = err.getvalue()
    if status == BAD_INPUT and said.startswith("fabfem: ") and said.count("\n") == 1 and file.name in said:
        return Judged("refused", said.strip())
    if status != DONE or said:
        return Judged("fault", f"status {status}: {said.strip() or 'nothing said'}")
    same = resolved(read_case(file)) == resolved(read_case(original))
    return Judged("accepted, same" if same else "accepted, other", "")


def solved(file: Path, folder: Path, seconds: float) -> Judged:
    """Return what a run of a mutant comes to that ends by itself, or by an interrupt after some seconds."""
    run = subprocess.Popen(
        [sys.executable, "-m", "fabfem", "solve", "--quiet", str(file), "--out", str(folder)],
        **{"cwd": ROOT, "stderr": subprocess.PIPE, "text": True, "preexec_fn": bounded},
    )
    said, wait = "", seconds
    while run.poll() is None:  # again and again: one that meets the compiler may be lost
        with contextlib.suppress(subprocess.TimeoutExpired):
            said = run.communicate(timeout=wait)[1]
            break
        run.send_signal(signal.SIGINT)
        wait = 3.0
    known = {DONE: "completed", STOPPED: "stopped", BAD_INPUT: "refused", INTERRUPTED: "still going on"}
    known[-signal.SIGINT] = "still going on"  # one more that arrived when the run was over
    if run.returncode not in known or "fault of the program" in said or "Traceback" in said:
        return Judged("fault", f"status {run.returncode}: {said.strip()[-300:]}")
    if (folder / "history.csv").is_file():
        headers, rows = read_history(folder / "history.csv")
        told = [i for i, header in enumerate(headers) if not UNTOLD.match(header)]
        if any(row[i].lower() in ("nan", "inf", "-inf") for row in rows for i in told):
            return Judged("fault", "a number in the history is not finite")
    return Judged(known[run.returncode], said.strip())


def bounded() -> None:
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))


def fuzz(folder: Path, count: int, seed: int) -> Iterator[tuple[Path, Path, Judged]]:
    """Yield mutants, the cases that they were made from, and what `check` makes of them."""
    originals = copied(folder)
    texts = {file: file.read_text(encoding="utf-8") for file in originals}
    chance = random.Random(seed)
    signal.signal(signal.SIGALRM, _too_long)
    for number in range(count):
        original = chance.choice(originals)
        file = original.with_name(f"mutant_{number:04d}.toml")
        file.write_bytes(mutant(texts[original], chance))
        yield file, original, checked(file, original)


class TooLongError(BaseException):
    """More than `PATIENCE`; nothing but the fuzz itself catches it."""


def _too_long(*given: object) -> None:
    raise TooLongError


def _main() -> int:
    words = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    words.add_argument("--count", type=int, default=2000)
    words.add_argument("--seed", type=int, default=1)
    words.add_argument("--solve", type=int, default=60)
    words.add_argument("--seconds", type=float, default=10.0)
    words.add_argument("--folder", type=Path, default=Path("build/fuzz"))
    said = words.parse_args()
    bounded()
    os.environ["MPLBACKEND"] = "Agg"
    shutil.rmtree(said.folder, ignore_errors=True)
    said.folder.mkdir(parents=True)
    verdicts: Counter[str] = Counter()
    accepted: list[Path] = []
    for file, _original, judged in fuzz(said.folder, said.count, said.seed):
        verdicts[judged.verdict] += 1
        accepted += [file] if judged.verdict == "accepted, other" else []
        if judged.verdict == "fault":
            print(f"{file.parent.name}/{file.name}: {judged.what}", flush=True)
    print(*(f"check: {verdict:16} {number}" for verdict, number in sorted(verdicts.items())), sep="\n", flush=True)
    ends: Counter[str] = Counter()
    for file in random.Random(said.seed).sample(accepted, min(said.solve, len(accepted))):
        judged = solved(file, said.folder / "results" / file.stem, said.seconds)
        ends[judged.verdict] += 1
        if judged.verdict == "fault":
            print(f"{file.parent.name}/{file.name}: {judged.what}", flush=True)
    print(*(f"solve: {verdict:16} {number}" for verdict, number in sorted(ends.items())), sep="\n")
    return 1 if verdicts["fault"] + ends["fault"] else 0


if __name__ == "__main__":
    with contextlib.suppress(CaseError):
        raise SystemExit(_main())
