"""Nets of geometrically nonlinear beams: joints, supports, loads, walls, equilibrium::

net = BeamNet(nodes, elements, Section.circular(radius, young_modulus, poisson_ratio))
problem = Problem(net, supports=Supports.clamp(len(nodes), [0]), loads=loads)
equilibrium = follow_path(problem)
"""

from braidcast.mechanics.beams import BeamNet, Section, State
from braidcast.mechanics.contact import Contact, SignedDistance
from braidcast.mechanics.equilibrium import Equilibrium, NewtonOptions, follow_path
from braidcast.mechanics.problem import Joints, Problem, Supports
from braidcast.mechanics.surfaces import Cylinder, Plane, Sphere

__all__ = [
    "BeamNet",
    "Contact",
    "Cylinder",
    "Equilibrium",
    "Joints",
    "NewtonOptions",
    "Plane",
    "Problem",
    "Section",
    "SignedDistance",
    "Sphere",
    "State",
    "Supports",
    "follow_path",
]
