"""One file a format: each gives tables of columns that are not read yet. Logs are in `messages`."""

from gmwm.readers.formats.frame import is_frame as is_frame
from gmwm.readers.formats.joining import (
    Part as Part,
    has_sensors as has_sensors,
    joined as joined,
    shares as shares,
    with_temperature as with_temperature,
)
from gmwm.readers.formats.kinds import is_text as is_text, open_tables as open_tables
from gmwm.readers.formats.messages import Wanted as Wanted
