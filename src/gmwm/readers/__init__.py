"""Files to recordings: one module for each kind of file.

A file becomes a `Table` (named columns, not yet read), `columns` decides which column is which
channel and in what unit, `samples` reads and converts them, `clock` turns time stamps into a rate,
`rest` looks for what sensors at rest contradict. Whatever cannot be used raises
`gmwm.errors.InputError` with one sentence: what is wrong, where, and how to correct it.

Names are loaded when they are first used: the command line asks only for those of the formats.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
