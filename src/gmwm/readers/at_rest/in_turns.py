"""Whether rows that share a stamp are a batch of one sensor, or of several sensors in turns."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gmwm._core.notices import Notice
from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.readers import tuning
from gmwm.readers.at_rest.rotation import block_means
from gmwm.readers.recording import Channel, Recording


def turn_notices(
    recording: Recording, rows: int, telling: Sequence[str], *, is_even: bool
) -> tuple[Notice, ...]:
    """Compare the first rows of stamps with the second ones, and so on.

    Of one sensor they differ by its fast noise only. Of several each has a bias of its own, which
    wanders by itself. Where nothing wanders and the means are alike, the samples do not tell.

    rows: That share a stamp.
    telling: Columns whose values come in turns with the rows, for messages.
    is_even: Whether all stamps have as many rows.
    Raises InputError if they are of several sensors.
    """
    turns = [_Turns.of(channel, rows) for channel in recording.inertial]
    found = [each for each in turns if each is not None]
    if not found:
        return ()
    worst = max(found, key=lambda each: each.apart)
    text = f"{rows} rows come with each stamp"
    values = {"rows": rows, "apart": worst.apart}
    which = f", which {' and '.join(telling)} tells apart" if telling else ""
    if worst.is_sure:
        text += f", and their means of {worst.name} are {worst.apart:.2g} standard deviations apart"
        if worst.apart > tuning.SENSORS_APART or telling:
            raise InputError(
                f"{recording.source}: {text}: {rows} sensors in turns{which}",
                "sensors-in-turns",
                f"keep the rows of one, or, if there is but one, give rate={recording.rate:.6g} "
                "and time=False",
                {"rate": recording.rate},
            )
        text += f": they may be of {rows} sensors in turns{which}"
    elif any(each.wanders for each in found):
        text += f", and their means wander apart: they may be of {rows} sensors in turns{which}"
    elif any(each.is_one for each in found) or not is_even:
        return ()
    else:
        text += (
            f" all through, of one sensor that is read so or of {rows} sensors in turns{which}: "
            "the samples do not tell"
        )
    hint = (
        f"if of {rows} sensors, keep the rows of one: N comes out too small by the root of {rows}"
    )
    return (Notice("sensors-in-turns", "warning", "", text, values, hint),)


@dataclass(frozen=True)
class _Turns:
    """One channel in rows that share a stamp.

    apart: Distance between the means of first, second, ... rows, of the scatter of samples.
    is_sure: Whether noise does not explain it.
    wanders: Whether it changes more slowly than fast noise does.
    is_one: Whether what the rows share wanders, or is a bias, while they differ by noise alone.
    """

    name: str
    apart: float
    is_sure: bool
    wanders: bool
    is_one: bool

    @classmethod
    def of(cls, channel: Channel, rows: int) -> _Turns | None:
        """None if there are too few samples, or the rows of a stamp are all the same."""
        values = channel.values[: channel.n // rows * rows].reshape(-1, rows) - channel.mean
        mean, differences = np.mean(values, axis=1), np.diff(values, axis=1)
        size = values.shape[0] // tuning.BLOCKS_OF_TURNS
        known = np.count_nonzero(~np.isnan(mean))
        if known < tuning.BLOCKS_OF_TURNS * tuning.FEWEST_OF_TURNS or not np.nanmax(differences**2):
            return None
        scatter = float(np.nanstd(differences)) / np.sqrt(2.0)
        between, error = _mean_of(differences, size)
        is_sure = bool(np.any(between > tuning.SURE_OF_TURNS * error))
        wanders = any(_wanders(column) for column in differences.T)
        # Gravity is the same of all accelerometers.
        bias = abs(channel.mean) if channel.quantity == "gyro" else 0.0
        _, error = _mean_of(mean[:, None], size)
        has_bias = bool(bias > tuning.SURE_OF_TURNS * error[0])
        is_one = not (is_sure or wanders) and (has_bias or _wanders(mean))
        return cls(channel.name, float(np.max(between)) / scatter, is_sure, wanders, is_one)


def _mean_of(columns: FloatArray, size: int) -> tuple[FloatArray, FloatArray]:
    """Absolute means, and their standard errors, from those of blocks."""
    blocks = block_means(list(columns.T), size)
    count = np.count_nonzero(~np.isnan(blocks), axis=0)
    return np.abs(np.nanmean(blocks, axis=0)), np.nanstd(blocks, axis=0) / np.sqrt(count)


def _wanders(values: FloatArray) -> bool:
    """Whether means of long blocks vary more than the noise of short ones explains."""
    long = values.size // tuning.BLOCKS_OF_TURNS
    of_long, of_short = (
        np.nanvar(block_means([values], size)) * size
        for size in (long, long // tuning.SHORTER_OF_TURNS)
    )
    return bool(of_long > tuning.WANDERS * of_short)
