"""Delimited text: lines, fields, the layout of a file, dialects of exporters, and the table."""

from gmwm.readers.text.cells import DATE as DATE, seconds_of as seconds_of
from gmwm.readers.text.csv_table import CsvTable as CsvTable
from gmwm.readers.text.lines import content_size as content_size
