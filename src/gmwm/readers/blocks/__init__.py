"""Recordings that are read a block at a time."""

from gmwm.readers.blocks.blocks import notices_of_blocks, read_blocks

__all__ = ["notices_of_blocks", "read_blocks"]
