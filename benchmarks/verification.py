"""The table of verification: python benchmarks/verification.py [docs/verification.md]

Prints every problem with its source, reference, result, error and bar, and writes them to the
given file. Ends with 1 if a bar is missed.
"""

import sys
from pathlib import Path

from problems import PROBLEMS
from problems.row import Row

PAGE = """# Verification

The mechanics against closed forms, published values and itself. Made by
`python benchmarks/verification.py docs/verification.md`; the tests hold every row to its bar.

- Errors are relative where the reference is one number, else absolute (mm, or a share of the
  length L).
- *Roll-up*: supports keep it in its plane. A spin moment of fixed direction has no potential in
  space, so that there the symmetric tangent would not be its derivative.
- *Lateral buckling*: the load at which the Cholesky factorisation of the tangent first fails, by
  bisection along the flat path.
- *Ring*: straight beams whose axis is given the directions of the circle at its nodes
  (`end_tangents`); with the bare polygon the mean gap is 2 % off, for its sagitta is ten times
  the penetration.
- *Joints*: a spring opens by its force over its stiffness, here the paper's 1e3 N/mm, so that a
  joint that carries more than 0.01 N opens by more than 1e-5 mm: the same braid moved by 2 mm
  instead of 0.5 mm comes out 5e-5 mm apart, and that is the penalty's error, not the net's.
- *Contact law*, ring: errata row 10, the regularised penalty.

{table}
"""


def table(rows: list[Row]) -> str:
    lines = ["| problem | source | reference | ours | error | bar |", "|---|---|---|---|---|---|"]
    for r in rows:
        lines.append(
            f"| {r.problem} | {r.source} | {r.reference} | {r.ours} | {r.error:.1e} "
            f"| {r.bar:.0e}{'' if r.holds else ' **missed**'} |"
        )
    return "\n".join(lines)


def main() -> int:
    rows = [row for problem in PROBLEMS for row in problem()]
    print(table(rows))
    if len(sys.argv) > 1:
        Path(sys.argv[1]).write_text(PAGE.format(table=table(rows)), encoding="utf-8")
    return 0 if all(row.holds for row in rows) else 1


if __name__ == "__main__":
    sys.exit(main())
