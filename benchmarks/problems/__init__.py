"""Verification problems of mechanics and vessels, each with its source, its reference and its bar.

The tests assert every row of ``PROBLEMS``; ``benchmarks/verification.py`` prints them. Timings have
no place here.
"""

from problems import elements, nets, statics, surfaces, walls

PROBLEMS = (
    *elements.PROBLEMS,
    *statics.PROBLEMS,
    *walls.PROBLEMS,
    *nets.PROBLEMS,
    *surfaces.PROBLEMS,
)
