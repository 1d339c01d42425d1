"""Shared libraries with an Abaqus UMAT entry point around the kernel that our own runs use.

`layout` what PROPS and STATEV hold, `start` the state of a first call, `point` one call in compiled form, `record`
arrays in a block of memory, `library` machine code and linking. numba compiles the kernels as for any run; here their
code is written out with the entry point `umat_` and linked. The library needs the C library and nothing else: no
Python, no numba. Every thread has its own storage, so that threads may call at once.
"""

from pathlib import Path

from umat.chang_hicher import ChangHicher
from umat.directions import Directions
from umat.export.layout import Layout, layout_of

__all__ = ["Layout", "export_umat", "layout_of"]


def export_umat(material: ChangHicher, directions: Directions, library: Path, cpu: str = "host") -> Layout:
    """Write a shared library with the routine `umat_` of a material; return what its PROPS and STATEV hold.

    Parameters
    ----------
    material : ChangHicher
        Its parameters, and the unit of stress, become part of the library.
    directions : Directions
        A rule on half the sphere: a library serves plane strain and solids alike.
    library : Path
        The file to write.
    cpu : str
        Processor that the code is for: ``host``, the one of this machine, ``generic``, or ``x86-64-v2`` to ``-v4``.

    Raises
    ------
    ValueError
        If the directions are mirrored, the processor is unknown, there is no linker, or it fails.
    """
    from umat.export.library import check_tools, write
    from umat.export.point import entry_point

    if directions.symmetry != "half":
        raise ValueError("a library needs directions on half the sphere: it does not know the plane of symmetry")
    check_tools(cpu)
    layout = layout_of(material, directions)
    write(entry_point(material, directions, layout), layout, Path(library), cpu)
    return layout
