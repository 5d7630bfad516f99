"""These tests write files with the libraries of the extras, which `.[test]` installs."""

from importlib.util import find_spec

# Where the lowest versions are tested, the extras are absent.
collect_ignore = [
    file
    for file, modules in {
        "messages/test_damaged_logs.py": ("pyulog",),
        "messages/test_read_rosbag.py": ("rosbags",),
        "test_read_frames.py": ("rosbags", "h5py", "polars"),
        "messages/test_read_flight_logs.py": ("rosbags", "pyulog", "pymavlink"),
    }.items()
    if not all(map(find_spec, modules))
]
