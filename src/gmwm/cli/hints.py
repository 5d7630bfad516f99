"""What an error of the library means on the command line: its options, by the error's code."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from gmwm.errors import InputError

if TYPE_CHECKING:
    from gmwm.calibration import Calibration
    from gmwm.issues import Notice

HINTS = {
    "accel-unit-missing": "--accel-unit {unit}",
    "channel-unknown": "--channel gyro_x=COLUMN for each channel",
    "channels-swapped": "--channel accel_x=COLUMN for each channel",
    "clock": "--rate 100 --time none",
    "damaged": "get a whole copy, or read the rest with --damaged",
    "earlier-runs": "--resume, or -o FOLDER",
    "gyro-unit-missing": "--gyro-unit deg/s",
    "heading-unknown": "--heading DEG, or heading: in the file",
    "layout": "--layout LAYOUT, one of those in the help of gmwm calibrate",
    "memory": "--channel gyro_x=COLUMN for each of some channels, or, if there is more, "
    "--memory GB with gmwm calibrate and health, and GMWM_MEMORY=GB before the others",
    "missing-key": "--trajectory, --truth and --filter, or --imu, --gnss and --sensors",
    "model-missing": "--model '{channel}=N + K', or leave it out by --channels",
    "no-rest": "--all to take everything as static",
    "no-stamps": "--clock log",
    "other-runs": "-o FOLDER",
    "output": "{first}choose another place with -o",
    "rate": "--rate 100",
    "rate-contradicted": "leave out the rate to use the stamps, or add --time none",
    "runs-in-use": "-o FOLDER",
    "sensor-absent": "record them too, or calibrate the rest alone, --channels {sensor}",
    "time-unit": "--rate {rate:.6g}, or name the column {column}",
    "topic": "--topic NAME",
    "topics-apart": "--topic NAME or --clock log",
    "unit-missing": "name the channel gyro_... or accel_... and give --gyro-unit or --accel-unit",
}


def with_hint(error: InputError) -> str:
    """The message of an error, its hint in the words of the command line."""
    hint = " ".join(HINTS[code] for code in error.code.split() if code in HINTS)
    usual = {"rate": 100.0, "column": "by its unit", "unit": "g"}
    hint = hint.format(**(usual | error.values))
    if not hint:
        return str(error)
    if error.code == "clock":  # to ignore the stamps is right only if nothing else is
        return str(error).replace("give rate= and time=False", f"give e.g. {hint}")
    if error.hint:
        return f"{error.problem}: {'give e.g. ' if hint.startswith('-') else ''}{hint}"
    return f"{error} (on the command line: {hint})"


def in_options(calibration: Calibration) -> Calibration:
    """A calibration whose notices advise in options, for a report of the command line."""
    fits = {
        name: replace(fit, notices=tuple(map(with_option, fit.notices)))
        for name, fit in calibration.items()
    }
    notices = tuple(map(with_option, calibration.notices))
    return replace(calibration, fits=fits, notices=notices)


def with_option(notice: Notice) -> Notice:
    """A notice with the options that do what it advises."""
    from gmwm.calibration import LONGEST_PART

    values = notice.values
    if notice.code == "sd-assumed":
        return replace(notice, hint=f"give --{notice.where}-sd")
    if notice.code == "axis-up":
        hint = (
            "correct if the sensor is mounted upside down; otherwise give --channel gyro_z=-NAME "
            "--channel accel_z=-NAME, and also y if it points left"
        )
        return replace(notice, hint=hint)
    if notice.code in ("not-static", "tilt") and "start" in values:
        start, stop = values["start"], values["stop"]
        return replace(notice, hint=f"{notice.hint}; --start {start:.6g} --stop {stop:.6g}")
    if notice.code == LONGEST_PART:
        ends = {"start": 0.0, "stop": values["of"]}
        cut = " ".join(f"--{k} {values[k]:.6g}" for k, end in ends.items() if values[k] != end)
        hint = cut + ", or --remove-departures, which subtracts them" * values["removable"]
        return replace(notice, hint=hint)
    if notice.severity == "note" or not values.get("evident") or values.get("together"):
        return notice
    first, last = values["time_lower"], values["time_upper"]
    cut = {
        "step": f"--stop {first:.6g} or --start {last:.6g}",
        "transient": f"--start {3.0 * last:.6g}",
        "drift-at-start": f"--start {last:.6g}",
        "slow-period": "",
    }[notice.code]
    options = [each for each in (cut, "--remove-departures" * values["removable"]) if each]
    advice = ": ".join([notice.hint.partition(",")[0], *filter(None, [", or ".join(options)])])
    return replace(notice, hint=advice)
