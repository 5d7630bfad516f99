"""Recordings that are read a block at a time."""

from gmwm.readers.blocks.blocks import (
    notices_of_blocks as notices_of_blocks,
    read_blocks as read_blocks,
)
from gmwm.readers.blocks.row_keys import MIXED as MIXED, RowKeys as RowKeys, row_keys as row_keys
