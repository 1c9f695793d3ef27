"""Verification problems of the mechanics, each with its source, its reference and its bar.

The tests assert every row of ``PROBLEMS``; ``benchmarks/verification.py`` prints them. Timings have
no place here.
"""

from problems import elements, nets, statics, walls

PROBLEMS = (*elements.PROBLEMS, *statics.PROBLEMS, *walls.PROBLEMS, *nets.PROBLEMS)
