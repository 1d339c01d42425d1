"""``fields.pvd`` and one ``.vtu`` file for each stored increment.

The files are zlib-compressed XML of the VTK version 1.0 format, readable by ParaView, VTK, pyvista and meshio. They
are written here and not by meshio, which can name no components (ParaView shows them) and keeps no field data (time,
sign convention). Fields are stored in single precision.
"""

import base64
import struct
import zlib
from collections.abc import Iterator, Mapping, Sequence
from html import escape  # xml.sax.saxutils loads all of urllib and ssl
from pathlib import Path
from typing import Any, NamedTuple
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from fabfem.output.atomic import write_atomic

CELL_TYPES = {
    "triangle": 5,
    "quad": 9,
    "tetra": 10,
    "hexahedron": 12,
    "triangle6": 22,
    "quad8": 23,
    "tetra10": 24,
    "hexahedron20": 25,
    "quad9": 28,
    "hexahedron27": 29,
}
"""VTK's number of each cell type; nodes are in VTK's order already."""

TENSOR = ("XX", "YY", "ZZ", "XY", "YZ", "XZ")
"""Components of a symmetric tensor in VTK's order."""

COMPONENTS = {1: (), 3: ("X", "Y", "Z"), 6: TENSOR}
TYPES = {"f4": "Float32", "f8": "Float64", "i4": "Int32", "i8": "Int64", "u1": "UInt8"}

Arrays = Mapping[str, NDArray[np.float64]]


class Frame(NamedTuple):
    """The fields of one stored increment."""

    time: float
    """Time of the run, or number of the increment where no time is meant."""
    at_nodes: Arrays
    """Fields at nodes, first axis the node."""
    in_cells: Arrays
    """Means in cells, first axis the cell."""
    points: NDArray[np.float64] | None = None
    """Places of the nodes where they are not those of the files."""


class FieldFiles:
    """The ``.vtu`` files of a run and the collection that lists them; `stored` are those of an earlier run."""

    def __init__(
        self,
        folder: Path,
        points: NDArray[np.float64],
        cells: NDArray[np.integer],
        cell_type: str,
        note: str,
        stored: Sequence[tuple[float, str]] = (),
    ) -> None:
        self.folder = folder
        self.note = note.replace("--", "-")
        self._cells, self._cell_type = cells, cell_type
        self._geometry = _geometry(points, cells, cell_type)
        self.stored = list(stored)
        if stored:
            self._list_all()

    def write(self, frame: Frame) -> Path:
        """Store a frame and list it in the collection; return its file."""
        name = f"fields_{len(self.stored):04d}.vtu"
        write_atomic(self.folder / name, "\n".join(self._lines(frame)))
        self._listed(frame.time, name)
        return self.folder / name

    def _listed(self, time: float, name: str) -> None:
        """List a file in the collection."""
        self.stored.append((time, name))
        self._list_all()

    def _list_all(self) -> None:
        write_atomic(self.folder / "fields.pvd", self._collection())

    def _lines(self, frame: Frame) -> Iterator[str]:
        yield '<?xml version="1.0"?>'
        yield f"<!-- {self.note} -->"
        yield (
            '<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" header_type="UInt64"'
            ' compressor="vtkZLibDataCompressor"><UnstructuredGrid>'
        )
        yield "<FieldData>"
        yield _array("TimeValue", np.array([frame.time]), tuples=True)
        yield _array("compression_positive", np.array([1], dtype=np.int32), tuples=True)
        yield "</FieldData>"
        yield self._geometry if frame.points is None else _geometry(frame.points, self._cells, self._cell_type)
        for place, fields in (("PointData", frame.at_nodes), ("CellData", frame.in_cells)):
            yield f"<{place}>"
            yield from (_array(name, np.asarray(values, dtype=np.float32)) for name, values in fields.items())
            yield f"</{place}>"
        yield "</Piece></UnstructuredGrid></VTKFile>\n"

    def _collection(self) -> str:
        entries = [f'<DataSet timestep="{time!r}" part="0" file="{name}"/>' for time, name in self.stored]
        head = f'<?xml version="1.0"?>\n<!-- {self.note} -->\n<VTKFile type="Collection" version="1.0"><Collection>'
        return "\n".join([head, *entries, "</Collection></VTKFile>\n"])


class FieldPieces(FieldFiles):
    """The files of a run that many ranks share: of each stored increment a ``.pvtu`` and a ``.vtu`` of every rank.

    Every rank makes one of these for its part of the mesh; the first writes the ``.pvtu`` and the collection.
    """

    def __init__(self, rank: int, size: int, *args: Any, **more: Any) -> None:
        self._rank, self._size = rank, size
        super().__init__(*args, **more)

    def write(self, frame: Frame) -> Path:
        """Store this rank's piece of a frame, and on the first rank what holds the pieces together; return its file."""
        name = f"fields_{len(self.stored):04d}"
        write_atomic(self.folder / self._piece(name, self._rank), "\n".join(self._lines(frame)))
        if self._rank == 0:
            write_atomic(self.folder / f"{name}.pvtu", "\n".join(self._together(name, frame)))
        self._listed(frame.time, f"{name}.pvtu")
        return self.folder / f"{name}.pvtu"

    def _list_all(self) -> None:
        if self._rank == 0:
            super()._list_all()

    def _piece(self, name: str, rank: int) -> str:
        return f"{name}_{rank:04d}.vtu"

    def _together(self, name: str, frame: Frame) -> Iterator[str]:
        yield '<?xml version="1.0"?>'
        yield f"<!-- {self.note} -->"
        yield (
            '<VTKFile type="PUnstructuredGrid" version="1.0" byte_order="LittleEndian" header_type="UInt64"'
            ' compressor="vtkZLibDataCompressor"><PUnstructuredGrid GhostLevel="0">'
        )
        yield "<FieldData>"
        yield _array("TimeValue", np.array([frame.time]), tuples=True)
        yield "</FieldData>"
        for place, fields in (("PPointData", frame.at_nodes), ("PCellData", frame.in_cells)):
            yield f"<{place}>"
            yield from (
                _head(field, np.asarray(values, dtype=np.float32), "P") + "/>" for field, values in fields.items()
            )
            yield f"</{place}>"
        yield f"<PPoints>{_head('Points', np.zeros((0, 3)), 'P')}/></PPoints>"
        yield from (f'<Piece Source="{self._piece(name, rank)}"/>' for rank in range(self._size))
        yield "</PUnstructuredGrid></VTKFile>\n"


def frames_of(folder: Path) -> list[tuple[float, Path]]:
    """Return time and file of each stored increment of a result, in order; none where nothing is stored."""
    collection = folder / "fields.pvd"
    entries = ElementTree.parse(collection).iter("DataSet") if collection.is_file() else ()
    return [(float(entry.attrib["timestep"]), folder / entry.attrib["file"]) for entry in entries]


def _geometry(points: NDArray[np.float64], cells: NDArray[np.integer], cell_type: str) -> str:
    spatial = np.zeros((len(points), 3))
    spatial[:, : points.shape[1]] = points
    count, nodes = cells.shape
    arrays = (
        _array("connectivity", cells.astype(np.int64).ravel()),
        _array("offsets", np.arange(1, count + 1, dtype=np.int64) * nodes),
        _array("types", np.full(count, CELL_TYPES[cell_type], dtype=np.uint8)),
    )
    return "\n".join(
        [
            f'<Piece NumberOfPoints="{len(points)}" NumberOfCells="{count}">',
            f"<Points>{_array('Points', spatial)}</Points>",
            f"<Cells>{''.join(arrays)}</Cells>",
        ]
    )


def _head(name: str, values: NDArray[np.generic], prefix: str = "", more: Mapping[str, str] = {}) -> str:
    """Return the beginning of a DataArray element, open for further attributes."""
    width = int(np.prod(values.shape[1:], dtype=int))
    attributes = {
        "type": TYPES[values.dtype.str[1:]],
        "Name": name,
        **({"NumberOfComponents": str(width)} if values.ndim > 1 else {}),
        **{f"ComponentName{i}": part for i, part in enumerate(_component_names(width))},
        **more,
    }
    said = " ".join(f'{key}="{escape(text)}"' for key, text in attributes.items())
    return f"<{prefix}DataArray {said}"


def _array(name: str, values: NDArray[np.generic], tuples: bool = False) -> str:
    """Return a DataArray element with one zlib block of little-endian values."""
    more = {**({"NumberOfTuples": str(len(values))} if tuples else {}), "format": "binary"}
    raw = np.ascontiguousarray(values, dtype=values.dtype.newbyteorder("<")).tobytes()
    packed = zlib.compress(raw, 1)
    header = struct.pack("<4Q", 1, len(raw), len(raw), len(packed))
    content = (base64.b64encode(header) + base64.b64encode(packed)).decode()
    return f"{_head(name, values, more=more)}>{content}</DataArray>"


def _component_names(width: int) -> Sequence[str]:
    return COMPONENTS.get(width, ())
