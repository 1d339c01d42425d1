"""Files that are never seen half written."""

from pathlib import Path


def write_atomic(path: Path, content: bytes | str) -> None:
    """Write a file aside and rename it into place, so that a reader finds the old one or the new one.

    Parameters
    ----------
    path : Path
        File to write or replace.
    content : bytes or str
        All of its content; text is written as UTF-8.
    """
    aside = path.with_name(f".{path.name}.part")
    aside.write_bytes(content.encode() if isinstance(content, str) else content)
    aside.replace(path)
