"""Compiled code is kept in a folder that belongs to one state of the sources."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from umat import cache


@pytest.fixture
def package(tmp_path, monkeypatch):
    """Return a package of one source file, with a cache folder of its own."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setenv("LOCALAPPDATA", str(tmp_path / "cache"))
    monkeypatch.setattr(cache, "user_cache", lambda: tmp_path / "cache")
    monkeypatch.delitem(sys.modules, "numba", raising=False)
    monkeypatch.delenv(cache.VARIABLE, raising=False)
    folder = tmp_path / "package"
    folder.mkdir()
    (folder / "kernel.py").write_text("x = 1")
    return folder


def test_folder_is_made_and_told_to_numba(package):
    folder = cache.use_source_cache(package)
    assert folder.is_dir()
    assert os.environ[cache.VARIABLE] == str(folder)


def test_same_sources_share_a_folder_and_an_edit_gets_a_new_one(package):
    first = cache.use_source_cache(package)
    assert cache.use_source_cache(package) == first
    (package / "kernel.py").write_text("x = 2")
    assert cache.use_source_cache(package) != first


def test_sources_in_subpackages_count(package):
    first = cache.source_key([package])
    (package / "law").mkdir()
    (package / "law" / "new.py").write_text("")
    assert cache.source_key([package]) != first


def test_choice_of_the_user_is_left_alone(package, monkeypatch, tmp_path):
    monkeypatch.setenv(cache.VARIABLE, str(tmp_path / "mine"))
    assert cache.use_source_cache(package) is None
    assert os.environ[cache.VARIABLE] == str(tmp_path / "mine")


def test_without_a_writable_cache_the_temporary_folder_serves(package, monkeypatch):
    blocked = package / "kernel.py"
    monkeypatch.setattr(cache, "user_cache", lambda: blocked)
    folder = cache.use_source_cache(package)
    assert Path(cache.tempfile.gettempdir()) in folder.parents
    assert blocked not in folder.parents


def test_folders_unused_for_long_are_removed(package):
    first = cache.use_source_cache(package)
    (package / "kernel.py").write_text("x = 2")
    second = cache.use_source_cache(package)
    os.utime(first, (0, 0))
    assert cache.use_source_cache(package) == second
    assert not first.exists()
    assert second.exists()


def test_numba_is_imported_only_where_it_is_used():
    program = (
        "import sys, umat.mandel, umat.directions\n"
        "umat.Elastic(1.0, 0.3)\n"
        "assert 'numba' not in sys.modules and 'scipy' not in sys.modules\n"
        "from umat import VonMises\n"
        "import numba\n"
        "assert numba.config.CACHE_DIR == __import__('os').environ['NUMBA_CACHE_DIR']\n"
    )
    root = Path(cache.__file__).parents[1]
    subprocess.run([sys.executable, "-c", program], check=True, cwd=root)
