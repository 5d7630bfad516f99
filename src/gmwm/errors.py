"""The exceptions and warnings of the package."""


class InputError(ValueError):
    """What the user gave cannot be used.

    The message is one sentence: what is wrong, where, and how to correct it. The command
    line prints it and exits with code 2.

    Parameters
    ----------
    text : str
        The message.
    code : str, optional
        What kind of thing is wrong, for programs.
    """

    def __init__(self, text: str, code: str = "") -> None:
        super().__init__(text)
        self.code = code


class MissingNameError(InputError, KeyError):
    """A name that a mapping does not have."""

    __str__ = InputError.__str__


class FitWarning(UserWarning):
    """A fit that is not valid was returned; ``fit.notices`` give the reasons.

    ``warnings.simplefilter("ignore", gmwm.FitWarning)`` switches it off.
    """
