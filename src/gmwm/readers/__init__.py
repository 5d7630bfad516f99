"""Files to recordings: one module for each kind of file.

A file becomes a `Table` (named columns, not yet read), `roles` decides which column is which
channel, `clock` turns time stamps into a rate. Whatever cannot be used raises
`gmwm.errors.InputError` with one sentence: what is wrong, where, and how to mend it.
"""

from gmwm.readers.reader import read

__all__ = ["read"]
