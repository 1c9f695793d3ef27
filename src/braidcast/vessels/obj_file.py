"""The vertices and faces of a Wavefront OBJ file; whatever else it holds is passed over.

trimesh takes a relative index from the end of the file, not from the vertex before the face, and
stumbles over materials; of a surface no more than ``v`` and ``f`` is needed.
"""

from __future__ import annotations

from array import array
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from braidcast.errors import InputError
from braidcast.vessels.edges import Array, IntArray


def read_obj(path: Path) -> tuple[Array, IntArray, int]:
    """Vertices (n, 3), triangles (m, 3) of the fans of the faces, and how many faces there are.

    ``InputError``, its text to follow the surface's name, names the line of what is no vertex of
    three numbers, no face of three or more corners, and a corner that is not there. ``OSError``.
    """
    vertices, corners = array("d"), array("q")
    sizes, lines = array("q"), array("q")
    for line, words in _statements(path.read_bytes()):
        if words[0] == b"v":
            vertices.extend(_vertex(words, line))
        elif words[0] == b"f":
            corners.extend(_face(words, line, len(vertices) // 3))
            sizes.append(len(words) - 1)
            lines.append(line)
    points = np.array(vertices, dtype=np.float64).reshape(-1, 3)
    flat, count = np.array(corners, dtype=np.int64), np.array(sizes, dtype=np.int64)
    if len(flat) and flat.max() >= len(points):
        face = int(np.searchsorted(np.cumsum(count), np.argmax(flat >= len(points)), side="right"))
        raise InputError(
            f"is damaged: line {lines[face]} has the vertex {flat[flat >= len(points)][0] + 1}, "
            f"where there are {len(points)}"
        )
    return points, _fans(flat, count), len(count)


def _statements(data: bytes) -> Iterator[tuple[int, list[bytes]]]:
    """Number of the first line and words of each statement that has any, without comments."""
    begun: list[bytes] = []
    for number, line in enumerate(data.splitlines(), start=1):
        words = line.partition(b"#")[0].split()
        if begun:
            words = begun + words
        else:
            first = number
        if words and words[-1].endswith(b"\\"):
            begun = [word for word in (*words[:-1], words[-1][:-1]) if word]
            continue
        begun = []
        if words:
            yield first, words
    if begun:
        yield first, begun


def _vertex(words: list[bytes], line: int) -> list[float]:
    try:
        x, y, z = map(float, words[1:4])  # a weight or a colour may follow
    except ValueError:
        raise InputError(
            f"is damaged: line {line} must hold a vertex of three numbers, not {_said(words)}"
        ) from None
    return [x, y, z]


def _face(words: list[bytes], line: int, before: int) -> list[int]:
    """Corners of a face, from 0, after ``before`` vertices; each is v, v/vt, v//vn or v/vt/vn."""
    try:
        given = [int(word.partition(b"/")[0]) for word in words[1:]]
    except ValueError:
        given = []
    if len(given) < 3:
        raise InputError(
            f"is damaged: line {line} must hold a face of three or more vertices' numbers, not "
            f"{_said(words)}"
        )
    corners = [number - 1 if number > 0 else before + number for number in given]
    if 0 in given or min(corners) < 0:
        bad = next(n for n, c in zip(given, corners, strict=True) if n == 0 or c < 0)
        raise InputError(
            f"is damaged: line {line} has the vertex {bad}, must be from 1 up, or from -1 down to "
            f"{-before} after {before} vertices"
        )
    return corners


def _fans(corners: IntArray, sizes: IntArray) -> IntArray:
    """Triangles of polygons of ``sizes`` (p,) corners given one after another, each a fan."""
    first = np.repeat(np.cumsum(sizes) - sizes, sizes - 2)
    along = np.arange(len(first)) - np.repeat(np.cumsum(sizes - 2) - (sizes - 2), sizes - 2)
    return np.stack(
        [corners[first], corners[first + along + 1], corners[first + along + 2]], axis=1
    )


def _said(words: list[bytes]) -> str:
    text = b" ".join(words).decode(errors="replace")
    return repr(text if len(text) <= 60 else text[:57] + "...")
