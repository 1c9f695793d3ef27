"""What braidcast says when it is given something it cannot use."""


class InputError(ValueError):
    """Input that cannot be used: one sentence with the field, its value and what is allowed.

    The command line prints the sentence and ends with exit code 2.
    """


class OutsideGrid(ValueError):
    """A distance was asked for where it is not known: off the grid or beyond an open end."""
