"""Routines of `tests/umat/routines` as shared libraries, or the reason why there are none."""

import shutil
import subprocess
from pathlib import Path

import pytest

ROUTINES = Path(__file__).parent / "routines"
COMPILERS = {".c": ("gcc", "cc", "clang"), ".f": ("gfortran",)}


def compiled(name: str, folder: Path) -> str:
    """Return the library of a routine, compiled into a folder; skip the test where there is no compiler."""
    source = ROUTINES / name
    known = [found for compiler in COMPILERS[source.suffix] if (found := shutil.which(compiler))]
    if not known:
        pytest.skip(f"none of {', '.join(COMPILERS[source.suffix])} is installed to compile {name}")
    library = folder / f"{source.stem}.so"
    subprocess.run([known[0], "-O2", "-shared", "-fPIC", "-o", str(library), str(source), "-lm"], check=True)
    return str(library)
