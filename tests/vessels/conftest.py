"""Surfaces that tests of vessels start from."""

import sys
from pathlib import Path

import numpy as np
import pytest

# The exact shapes are those of the benchmarks.
sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))

Mesh = tuple[np.ndarray, np.ndarray]


@pytest.fixture(scope="session")
def tube():
    """A function that makes a straight tube along z, open at both ends, facing outwards."""

    def make(radius=1.5, length=20.0, facets=32, rings=41) -> Mesh:
        angle = np.arange(facets) * (2 * np.pi / facets)
        z = np.linspace(0.0, length, rings)
        ring = radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        vertices = np.column_stack([np.tile(ring, (rings, 1)), np.repeat(z, facets)])
        here = np.arange(rings * facets).reshape(rings, facets)
        right = np.roll(here, -1, axis=1)
        a, b, c, d = (part.ravel() for part in (here[:-1], right[:-1], right[1:], here[1:]))
        triangles = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
        return vertices, triangles

    return make


@pytest.fixture(scope="session")
def capped():
    """A function that closes a tube of ``facets`` by a fan at each end."""

    def make(vertices, triangles, facets=32) -> Mesh:
        n = len(vertices)
        low, high = np.arange(facets), np.arange(n - facets, n)
        hubs = [vertices[low].mean(axis=0), vertices[high].mean(axis=0)]
        bottom = np.stack([np.roll(low, -1), low, np.full(facets, n)], axis=1)
        top = np.stack([high, np.roll(high, -1), np.full(facets, n + 1)], axis=1)
        return np.vstack([vertices, hubs]), np.concatenate([triangles, bottom, top])

    return make
