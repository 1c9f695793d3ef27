"""Vessels: centrelines, lumens as signed distance fields, and their surfaces."""

from braidcast.vessels.centreline import QuadraticBezier
from braidcast.vessels.parametric import SaccularVessel, Sphere, Tube
from braidcast.vessels.surface import vessel_surface, write_stl

__all__ = [
    "QuadraticBezier",
    "SaccularVessel",
    "Sphere",
    "Tube",
    "vessel_surface",
    "write_stl",
]
