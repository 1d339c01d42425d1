"""Routines of `tests/umat/routines` as shared libraries, or the reason why there are none."""

import shutil
import subprocess
from pathlib import Path

import pytest

ROUTINES = Path(__file__).parent / "routines"
COMPILERS = {".c": ("gcc", "cc", "clang"), ".f": ("gfortran",)}


def compiled(name: str, folder: Path, *options: str, shared: bool = True) -> str:
    """Return the library, or program, of a source, compiled into a folder; skip the test if there is no compiler."""
    source = ROUTINES / name
    known = [found for compiler in COMPILERS[source.suffix] if (found := shutil.which(compiler))]
    if not known:
        pytest.skip(f"none of {', '.join(COMPILERS[source.suffix])} is installed to compile {name}")
    library = folder / f"{source.stem}{'.so' if shared else ''}"
    kind = ["-shared", "-fPIC"] if shared else []
    subprocess.run([known[0], "-O2", *kind, "-o", str(library), str(source), "-lm", *options], check=True)
    return str(library)
