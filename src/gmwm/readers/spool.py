"""Columns of a file: in memory, or on disk if the file is long."""

from __future__ import annotations

from collections.abc import Sequence

from gmwm._core import memory
from gmwm._core.spool import Spool
from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.readers import tuning
from gmwm.readers.table import Table


def load_columns(table: Table, columns: Sequence[int]) -> dict[int, FloatArray]:
    """Some columns of a table; those of a long file are mapped from temporary files.

    What follows treats both alike. A file is long if it needs more than `gmwm._core.memory.held`
    and its kind can be read in blocks.
    """
    blocks = getattr(table, "segments", None)
    if blocks is None:
        return table.load(columns)
    try:
        with memory.limited(memory.held()):
            return table.load(columns)
    except InputError as error:
        if error.code != "memory":
            raise
    spools = {column: Spool(1) for column in columns}
    with memory.limited(max(memory.budget() / (1 << 30), tuning.GIGABYTES_OF_BLOCK)):
        for block in blocks(columns, tuning.ROWS_OF_BLOCK):
            for column, values in block.items():
                spools[column].append(values)
    if not spools[columns[0]].n:
        raise InputError(f"{table.source} holds no samples: record longer")
    return {column: spool.array()[:, 0] for column, spool in spools.items()}
