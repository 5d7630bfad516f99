"""Recordings that are read a block at a time."""

from gmwm.readers.blocks.blocks import (
    notices_of_blocks as notices_of_blocks,
    read_blocks as read_blocks,
)
