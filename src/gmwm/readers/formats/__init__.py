"""One file a format: each opens a file as tables of columns that are not read yet."""
