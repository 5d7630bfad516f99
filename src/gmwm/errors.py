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
    mend : str, optional
        How to correct it, where the command line has words of its own; ends the message.

    Attributes
    ----------
    problem : str
        The message without the mend.
    """

    def __init__(self, text: str, code: str = "", mend: str = "") -> None:
        super().__init__(f"{text}: {mend}" if mend else text)
        self.problem = text
        self.code = code
        self.mend = mend


class MissingNameError(InputError, KeyError):
    """A name that a mapping does not have."""

    __str__ = InputError.__str__


class FitWarning(UserWarning):
    """A fit that is not valid was returned; ``fit.notices`` give the reasons.

    ``warnings.simplefilter("ignore", gmwm.FitWarning)`` switches it off.
    """
