"""Where numba keeps compiled kernels: a folder named after the sources they come from.

numba's own cache does not see that a function called from another file has changed, and
then runs stale code.  A folder per state of the sources cannot be stale.  A folder that
the user has chosen with NUMBA_CACHE_DIR is left alone.  Nothing here imports numba.
"""

import hashlib
import os
import shutil
import sys
import tempfile
import time
from collections.abc import Iterable
from contextlib import suppress
from importlib import metadata
from pathlib import Path

VARIABLE = "NUMBA_CACHE_DIR"
FOLDER = "umat-numba"
KEPT = 60 * 24 * 3600.0


def use_source_cache(*packages: Path) -> Path | None:
    """Return the folder set for kernels of the source folders `packages`.

    None if the user has chosen a folder.  Call it before the kernels are imported: numba
    looks when a function is decorated.
    """
    chosen = os.environ.get(VARIABLE, "")
    if chosen and Path(chosen).parent.name != FOLDER:
        return None
    folder = _writable_folder(source_key(packages))
    os.environ[VARIABLE] = str(folder)
    if "numba" in sys.modules:
        sys.modules["numba"].config.CACHE_DIR = str(folder)
    return folder


def source_key(packages: Iterable[Path]) -> str:
    """Return a hash of all Python sources below `packages` and of numba's version."""
    digest = hashlib.sha256(_numba_version().encode())
    for package in packages:
        for source in sorted(package.rglob("*.py")):
            digest.update(str(source).encode())
            digest.update(source.read_bytes())
    return digest.hexdigest()[:16]


def user_cache() -> Path:
    """Return the folder where this platform wants a user's caches."""
    home = Path.home()
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA", home / "AppData" / "Local"))
    if sys.platform == "darwin":
        return home / "Library" / "Caches"
    return Path(os.environ.get("XDG_CACHE_HOME") or home / ".cache")


def _writable_folder(key: str) -> Path:
    """Return the folder of `key`; one for this process only if the cache is read-only."""
    with suppress(OSError, RuntimeError):
        folder = user_cache() / FOLDER / key
        folder.mkdir(parents=True, exist_ok=True)
        folder.touch()
        _forget_unused(folder.parent)
        if os.access(folder, os.W_OK):
            return folder
    return Path(tempfile.mkdtemp()) / FOLDER / key


def _forget_unused(root: Path) -> None:
    """Remove the folders of sources that nobody has used for `KEPT` seconds."""
    for folder in root.iterdir():
        if folder.stat().st_mtime < time.time() - KEPT:
            shutil.rmtree(folder, ignore_errors=True)


def _numba_version() -> str:
    with suppress(metadata.PackageNotFoundError):
        return metadata.version("numba")
    return "none"
