"""The documentation builds without a warning, where Sphinx is installed; every page is in a table of contents."""

import os
import re
import shutil
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

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
    command = [sys.executable, "-c", CHECK]
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
