"""What braidcast says when it is given something it cannot use."""


class InputError(ValueError):
    """Input that cannot be used: one sentence with the field, its value and what is allowed.

    The command line prints the sentence and ends with exit code 2.
    """
