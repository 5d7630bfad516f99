"""Pages of several recordings or units."""
