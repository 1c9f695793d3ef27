"""Vessels: centrelines, lumens as signed distance fields, and their surfaces."""

from braidcast.vessels.centreline import QuadraticBezier
from braidcast.vessels.parametric import SaccularVessel, Sphere, Tube

__all__ = ["QuadraticBezier", "SaccularVessel", "Sphere", "Tube"]
