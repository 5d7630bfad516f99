"""Results as tables of pandas, which is needed for nothing else."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from gmwm.errors import InputError

if TYPE_CHECKING:
    import pandas


def frame(rows: Iterable[Mapping[str, Any]], columns: Sequence[str]) -> pandas.DataFrame:
    """A table.

    rows: Column -> value; others than ``columns`` are left out.
    columns: In their order; an empty table has them too.
    Raises InputError if pandas is not installed.
    """
    try:
        import pandas
    except ImportError:
        raise InputError(
            "tables need pandas, which is not installed: pip install 'gmwm[pandas]'"
        ) from None
    return pandas.DataFrame([dict(row) for row in rows], columns=list(columns))
