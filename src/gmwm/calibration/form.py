"""What a stored calibration holds."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Field

from gmwm._core.forms import Form, NoticeForm, Notices, Rate, Samples, Text


class CalibrationForm(Form):
    """Of `Calibration`; each fit has a form of its own."""

    source: Text
    rate_hz: Rate
    n: Samples
    notices: Notices
    skipped: dict[Text, NoticeForm]
    channels: Annotated[dict[Text, dict[str, Any]], Field(max_length=10_000)]
