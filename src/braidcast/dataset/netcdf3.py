"""Where the values lie in a netCDF-3 file with 64-bit offsets.

The layout: "NetCDF Classic Format Specification", Unidata; version byte 2, no record variables.
Reading one field out of hundreds of files wants the place of its bytes, which scipy keeps to
itself; scipy writes the files.
"""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

MAGIC = b"CDF\x02"
_CHAR = 2
_DTYPES = {1: ">i1", 2: "S1", 3: ">i2", 4: ">i4", 5: ">f4", 6: ">f8"}


@dataclass(frozen=True)
class Place:
    """A variable's values: big-endian ``dtype`` in ``shape``, from the byte ``offset`` on."""

    dtype: np.dtype[Any]
    shape: tuple[int, ...]
    offset: int

    @property
    def size(self) -> int:
        """Number of bytes."""
        return math.prod(self.shape) * self.dtype.itemsize

    def values(self, content: bytes) -> NDArray[Any]:
        """The values inside the content of the whole file, a view of it."""
        count = math.prod(self.shape)
        return np.frombuffer(content, self.dtype, count, self.offset).reshape(self.shape)


@dataclass(frozen=True)
class Header:
    """Texts among the global attributes, and the places of the variables, by name."""

    texts: dict[str, str]
    variables: dict[str, Place]


def read_header(content: bytes) -> Header:
    """Header of a file given whole or by its beginning; ``ValueError`` if it is not one."""
    if content[:4] != MAGIC:
        raise ValueError("does not begin as a netCDF-3 file with 64-bit offsets does")
    reader = _Reader(content, offset=8)  # past the magic and the number of records
    try:
        sizes = [_dimension(reader) for _ in range(reader.list_length())]
        attributes = dict(_attribute(reader) for _ in range(reader.list_length()))
        variables = dict(_variable(reader, sizes) for _ in range(reader.list_length()))
        texts = {
            name: value.decode("utf-8")
            for name, (kind, value) in attributes.items()
            if kind == _CHAR
        }
    except (struct.error, KeyError, IndexError, UnicodeDecodeError) as error:
        raise ValueError(f"its header cannot be read: {error}") from None
    return Header(texts, variables)


def _dimension(reader: _Reader) -> int:
    reader.name()
    return reader.integer()


def _attribute(reader: _Reader) -> tuple[str, tuple[int, bytes]]:
    name, kind, count = reader.name(), reader.integer(), reader.integer()
    return name, (kind, reader.padded(count * np.dtype(_DTYPES[kind]).itemsize))


def _variable(reader: _Reader, sizes: list[int]) -> tuple[str, Place]:
    name = reader.name()
    shape = tuple(sizes[reader.integer()] for _ in range(reader.integer()))
    for _ in range(reader.list_length()):
        _attribute(reader)
    kind, _, offset = reader.integer(), reader.integer(), reader.long()
    return name, Place(np.dtype(_DTYPES[kind]), shape, offset)


class _Reader:
    """Takes one item after the other from the bytes of a header."""

    def __init__(self, content: bytes, offset: int) -> None:
        self._content = content
        self._offset = offset

    def integer(self) -> int:
        return self._unpack(">i", 4)

    def long(self) -> int:
        return self._unpack(">q", 8)

    def list_length(self) -> int:
        """Length of a list: a tag, or 0 for an absent list, and then the count."""
        self.integer()
        return self.integer()

    def name(self) -> str:
        return self.padded(self.integer()).decode("utf-8")

    def padded(self, size: int) -> bytes:
        """``size`` bytes; the file fills them up to a multiple of four."""
        if size < 0 or self._offset + size > len(self._content):
            raise IndexError("it ends too soon")
        start = self._offset
        self._offset += -(-size // 4) * 4
        return self._content[start : start + size]

    def _unpack(self, form: str, size: int) -> int:
        (value,) = struct.unpack_from(form, self._content, self._offset)
        self._offset += size
        return int(value)
