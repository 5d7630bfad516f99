"""What a stored calibration holds."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Field

from gmwm._core.forms import Form, Model as ModelForm, NoticeForm, Notices, Rate, Samples, Text

Span = Annotated[list[Annotated[int, Field(ge=0)]], Field(min_length=2, max_length=2)]


class CalibrationForm(Form):
    """Of `Calibration`; each fit has a form of its own."""

    source: Text
    rate_hz: Rate
    n: Samples
    notices: Notices
    skipped: dict[Text, NoticeForm]
    channels: Annotated[dict[Text, dict[str, Any]], Field(max_length=10_000)]
    rivals: dict[Text, Annotated[list[ModelForm], Field(max_length=1000)]] = Field(
        default_factory=dict
    )
    left_out: dict[Text, Annotated[list[Span], Field(max_length=1_000_000)]] = Field(
        default_factory=dict
    )
