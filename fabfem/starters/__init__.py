"""Starter cases: commented case files that run as they are, to be changed into one's own.

Each is a ``KIND.toml`` in this folder, with the script of its mesh where it has one, ``KIND_mesh.py``.
"""

from pathlib import Path

from fabfem.output.atomic import write_atomic

HOME = Path(__file__).parent
KINDS = ("footing", "slope", "hollow_cylinder", "element")
"""What there are starters of."""
SCHEMA = "fabfem.schema.json"
"""File that an editor completes and checks the case with; the first line of a starter names it."""


def start(kind: str, folder: Path) -> tuple[Path, ...]:
    """Write a starter, its mesh's script and the schema for the editor into a folder, and return the files.

    Parameters
    ----------
    kind : str
        One of `KINDS`.
    folder : Path
        Made if it is not there.

    Raises
    ------
    CaseError
        If one of the files is there already; nothing is written then.
    OSError
        If the folder cannot be written.
    """
    from fabfem.case import CaseError
    from fabfem.case.json_schema import schema_text

    texts = {file.name: file.read_text(encoding="utf-8") for file in sorted(HOME.glob(f"{kind}*")) if file.is_file()}
    for name in texts:
        if (folder / name).exists():
            raise CaseError(f"{folder / name}: is there already and is left as it is; name another folder")
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in (texts | {SCHEMA: schema_text()}).items():
        write_atomic(folder / name, text)
    return tuple(folder / name for name in sorted(texts, key=lambda name: not name.endswith(".toml")))
