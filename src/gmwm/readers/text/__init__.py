"""Delimited text: lines, fields, the layout of a file and the dialects of exporters."""
