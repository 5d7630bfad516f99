"""What an error of the library means on the command line: its options, by the error's code."""

from __future__ import annotations

from gmwm.errors import InputError

HINTS = {
    "accel-unit-missing": "--accel-unit g",
    "channel-unknown": "--channel gyro_x=COLUMN for each channel",
    "clock": "--rate 100 --time none",
    "earlier-runs": "--resume, or -o FOLDER",
    "gyro-unit-missing": "--gyro-unit deg/s",
    "heading-unknown": "--heading DEG, or heading: in the file",
    "memory": "--channel gyro_x=COLUMN for each of some channels",
    "missing-key": "--trajectory, --truth and --filter, or --imu, --gnss and --sensors",
    "other-runs": "-o FOLDER",
    "rate": "--rate 100",
    "runs-in-use": "-o FOLDER",
    "time-unit": "--rate 100",
    "unit-missing": "name the channel gyro_... or accel_... and give --gyro-unit or --accel-unit",
}


def with_hint(error: InputError) -> str:
    """The message of an error with the option that mends it."""
    hint = HINTS.get(error.code)
    return f"{error} (on the command line: {hint})" if hint else str(error)
