from .csv_table import CsvTable as CsvTable, content_size as content_size
from .layout import DATE as DATE, seconds_of as seconds_of
from .names import (
    AXES as AXES,
    TIME as TIME,
    bare as bare,
    meaning as meaning,
    stated_seconds as stated_seconds,
)
from .reader import read as read, read_imus as read_imus, with_thermometer as with_thermometer
from .recording import (
    READING as READING,
    Channel as Channel,
    Missing as Missing,
    Recording as Recording,
    require_recording as require_recording,
)
from .registry import (
    CLOCKS as CLOCKS,
    NAMES as NAMES,
    Wanted as Wanted,
    is_frame as is_frame,
    open_tables as open_tables,
)
from .rest import block_means as block_means, turning_gravity as turning_gravity
from .samples import load_columns as load_columns
from .table import label as label
