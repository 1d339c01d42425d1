"""The documentation builds without a warning, where Sphinx is installed; every page is in a table of contents."""

import os
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
