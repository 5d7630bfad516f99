"""The exceptions and warnings of the package."""

from collections.abc import Mapping
from types import MappingProxyType

_NONE: Mapping[str, float | str] = MappingProxyType({})
_LONGEST = 800  # characters of a message: it may list names, and quotes no document


def printable(text: str) -> str:
    """A text on one line: blanks for line ends, escapes for what a terminal would obey.

    Names from files are untrusted: they may hold control characters, halves of surrogate pairs
    (file names that are not UTF-8) or marks that turn the direction of writing.
    """
    if text.isprintable():
        return text
    return "".join(
        each if each.isprintable() else " " if each in "\t\n\r" else ascii(each)[1:-1]
        for each in text
    )


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
    hint : str, optional
        How to correct it, where the command line has words of its own; ends the message.
    values : mapping of str to (float or str), optional
        What the words of the command line hold.

    Attributes
    ----------
    problem : str
        The message without the hint.
    """

    def __init__(
        self, text: str, code: str = "", hint: str = "", values: Mapping[str, float | str] = _NONE
    ) -> None:
        self.problem = printable(text)
        text = f"{self.problem}: {printable(hint)}" if hint else self.problem
        super().__init__(text if len(text) <= _LONGEST else f"{text[: _LONGEST - 4]} ...")
        self.code = code
        self.hint = hint
        self.values = dict(values)


class MissingNameError(InputError, KeyError):
    """A name that a mapping does not have."""

    __str__ = InputError.__str__


class FitWarning(UserWarning):
    """A fit that is not valid was returned; ``fit.notices`` give the reasons.

    ``warnings.simplefilter("ignore", gmwm.FitWarning)`` switches it off.
    """
