"""One file a kind of error process."""
