"""The exceptions of the package."""


class InputError(ValueError):
    """What the user gave cannot be used.

    The message is one sentence that says what is wrong, where, and how to mend it. The command
    line prints it and exits with code 2.
    """
