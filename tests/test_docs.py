"""The documentation builds without a warning, every page is in a table of contents, and what it says to run runs."""

import os
import re
import shlex
import shutil
import subprocess
import sys
import tomllib
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest

from fabfem.case import case_from

ROOT = Path(__file__).parents[1]


@pytest.mark.skipif(
    not all(map(find_spec, ("sphinx", "myst_parser", "furo"))), reason="the extra 'docs' is not installed"
)
def test_the_site_builds_without_a_warning(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "-b", "html", "docs", str(tmp_path / "site")]
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    first = (tmp_path / "site" / "start.html").read_text(encoding="utf-8")
    assert "Run the footing" in first
    assert 'src="_images/footing_fabric.png"' in first
    assert "march" in (tmp_path / "site" / "api" / "fabfem.html").read_text(encoding="utf-8")


PAGES = ["README.md", "CONTRIBUTING.md", *sorted(str(file.relative_to(ROOT)) for file in (ROOT / "docs").glob("*.md"))]
BLOCK = re.compile(
    r"(?:<!-- (not run|parsed|into|prints)(?:: (.*?))? -->\n)?^```(\S*)\n(.*?)^```", re.MULTILINE | re.DOTALL
)
NO_CODE = ("", "{toctree}", "{eval-rst}")
INSTALLING = re.compile(r"^(python3 -m venv .venv|.venv/bin/pip install .)$", re.MULTILINE)
GIVEN = {
    "docs/architecture.md": """
import numpy as np, umat
material, directions = umat.Elastic(100.0, 0.3), None
old = umat.initial_state(material, None, np.zeros((2, 6)))
strain_increment = np.full((2, 6), 1e-3)
""",
    "docs/restart.md": """
from fabfem.boundary_value.problem import build
from fabfem.case import read_case
from fabfem.fem.solve import march
model = build(read_case("cases/slope/dawson.toml")).model
""",
}
"""What the Python of a page takes for granted."""


def blocks(page: str) -> list[tuple[str, str, str, str]]:
    """Return (mark, reason or case, language, code) of each block of a page."""
    return [match.groups(default="") for match in BLOCK.finditer((ROOT / page).read_text(encoding="utf-8"))]


@pytest.fixture(scope="session")
def ground(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder that has what a clone has, and the command."""
    home = tmp_path_factory.mktemp("reader")
    for folder in ("cases", "meshes", "tests", "docs"):
        (home / folder).symlink_to(ROOT / folder)
    (home / "bin").mkdir()
    (home / "bin" / "fabfem").write_text(f'#!/bin/sh\nexec "{sys.executable}" -m fabfem "$@"\n', encoding="utf-8")
    (home / "bin" / "fabfem").chmod(0o755)
    return home


def shell(code: str, ground: Path) -> None:
    """Run commands as they stand, with fabfem installed already."""
    code = INSTALLING.sub("", code).replace(".venv/bin/", "")
    environment = os.environ | {"PATH": f"{ground / 'bin'}:{os.environ['PATH']}", "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        ["bash", "-ec", code], cwd=ground, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr


def python(code: str, ground: Path) -> str:
    """Run a program and return what it prints."""
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=ground, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def parsed(line: str) -> None:
    """Let the command's own parser read a line."""
    from fabfem.cli import parser

    words = shlex.split(line, comments=True)
    if words and words[0] == "fabfem":
        status = 0
        try:
            parser().parse_args(words[1:])
        except SystemExit as end:  # which --help makes, too
            status = int(end.code or 0)
        assert status == 0, line


def merged(base: dict[str, Any], part: dict[str, Any]) -> dict[str, Any]:
    """Return tables with a part of other tables put in; materials of other names replace those that are there."""
    if "material" in part and "material" in base and not set(part["material"]) & set(base["material"]):
        base = {key: value for key, value in base.items() if key != "material"}
    both = {key for key in base if isinstance(base[key], dict) and isinstance(part.get(key), dict)}
    return base | part | {key: merged(base[key], part[key]) for key in both}


def case(code: str, mark: str, where: str, ground: Path) -> None:
    """Let the reader of cases read a block, or the case that it is a part of."""
    tables, file = tomllib.loads(code), ground / (where if mark == "into" else "cases/case.toml")
    if mark == "into":
        tables = merged(tomllib.loads(file.read_text(encoding="utf-8")), tables)
    case_from(tables, file)


@pytest.mark.skipif(not shutil.which("bash"), reason="there is no bash")
@pytest.mark.parametrize("page", [page for page in PAGES if any(block[2] not in NO_CODE for block in blocks(page))])
def test_the_code_of_a_page(page: str, ground: Path) -> None:
    """Every block runs, in the order of the page, or says why it does not."""
    before, said = GIVEN.get(page, ""), ""
    for mark, reason, language, code in blocks(page):
        if mark == "prints":
            assert said.endswith(code), said
        elif language in NO_CODE or mark == "not run":
            assert language in NO_CODE or len(reason) > 10
        elif mark == "parsed":
            assert len(reason) > 10
            for line in code.splitlines():
                parsed(line)
        elif language == "sh":
            shell(code, ground)
        elif language == "python":
            before += code  # goes on from the blocks before it
            said = python(before, ground)
        else:
            assert language == "toml", f"{page}: nothing runs {language}"
            case(code, mark, reason, ground)


@pytest.mark.parametrize("page", [*PAGES, "cases/README.md"])
def test_the_commands_in_a_text(page: str) -> None:
    """What stands between backticks is a command of the program, and its files are there."""
    for said in re.findall(r"`(fabfem [a-z][^`]*)`", (ROOT / page).read_text(encoding="utf-8")):
        if re.search(r"\b[A-Z]{3,}\b|…|\*", said):  # CASE, DIR and the like stand for something
            continue
        for command in map(str.split, said.split("&&")):
            parsed(" ".join(command if len(command) > 2 else [*command, "--help"]))
        for file in re.findall(r"cases/\S+\.toml", said):
            assert (ROOT / file).is_file(), f"{page}: {file}"


def test_every_block_that_is_not_run_is_known() -> None:
    """Their number is small; a new one is a decision."""
    left = [(page, block[1]) for page in PAGES for block in blocks(page) if block[0] in ("not run", "parsed")]
    assert len(left) <= 13, left


CHECK = """
import numpy as np, umat
from umat.sands import toyoura
from umat.directions import directions
from umat.fabric import LAWS, fabric_increment
law = LAWS["follower"]()
u = np.array([0.01, -0.005, -0.005, 0.0, 0.0, 0.0])
six = np.zeros(6)
along = law.critical_fabric * u / np.linalg.norm(u)
first = fabric_increment(law, six, six, 0.0, 0.0, u, u)
np.testing.assert_allclose(first, law.h * law.critical_fabric * u, rtol=1e-9)
np.testing.assert_allclose(fabric_increment(law, along, six, 0.0, 0.0, u, u), 0.0, atol=1e-12)
sand, rule = toyoura()._replace(law=law), directions("lebedev_11")
pressed = np.array([[100.0, 100.0, 100.0, 0.0, 0.0, 0.0]])
state = umat.initial_state(sand, rule, pressed, void_ratio=0.8)
new = umat.update(sand, rule, np.array([[2e-3, -1e-3, -1e-3, 0.0, 0.0, 0.0]]), state)
assert new.status[0] == 0 and new.state.fabric[0, 0] > 1e-5, new
"""


COMPILED = """
import numpy as np
from umat.fabric import LAWS
from umat.fabric_history import increment
row = np.zeros((1, 31))
row[0, 25:28] = 0.01, -0.005, -0.005
law = LAWS["follower"]()
np.testing.assert_allclose(increment(law, row)[0], law.h * law.critical_fabric * row[0, 25:], rtol=1e-9)
"""


def test_the_recipe_for_a_fabric_law(tmp_path: Path) -> None:
    """The file of CONTRIBUTING.md is put beside the other laws of a copy, imported as said, and found by its name."""
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    (code,) = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    shutil.copytree(ROOT / "umat", tmp_path / "umat", ignore=shutil.ignore_patterns("__pycache__"))
    (tmp_path / "umat" / "fabric" / "follower.py").write_text(code, encoding="utf-8")
    init = tmp_path / "umat" / "fabric" / "__init__.py"
    line = "from .constant import Constant\n"
    assert line in init.read_text()
    init.write_text(init.read_text().replace(line, f"{line}from .follower import Follower\n"))
    environment = os.environ | {"PYTHONPATH": str(tmp_path), "NUMBA_DISABLE_JIT": "1"}
    for check, more in ((CHECK, {}), (COMPILED, {"NUMBA_DISABLE_JIT": "0"})):
        command = [sys.executable, "-c", check]
        done = subprocess.run(
            command, cwd=tmp_path, env=environment | more, capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, done.stderr
