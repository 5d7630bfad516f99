"""Forms of stored numbers and certificates: what each key must hold."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Any

from pydantic import Field

from gmwm._core.forms import Form, Model as ModelForm, Notices, NotNegative, Positive, Rate, Text


class PredictedForm(Form):
    """Of `Predicted`."""

    time: Positive
    nees: NotNegative | None
    tightness: NotNegative | None


class FilterNumbersForm(Form):
    """Of `FilterNumbers`."""

    form: Text
    model: ModelForm
    horizon_s: Positive
    initial_sd: NotNegative
    method: Text
    predicted: Annotated[Sequence[PredictedForm], Field(max_length=100)]
    notices: Notices
    quantity: Text
    stderr: dict[Text, NotNegative] = Field(default_factory=dict)


class SensorNumbersForm(Form):
    """Of `SensorNumbers`; each axis has a form of its own."""

    source: Text
    rate_hz: Rate | None
    duration_s: Positive | None
    shared: bool
    channels: Annotated[dict[Text, dict[str, Any]], Field(min_length=1, max_length=10_000)]


class CheckForm(Form):
    """Of `Check`."""

    consumer: Text
    where: Text
    quantity: Text
    unit: Text
    time: NotNegative
    true: NotNegative | None
    believed: NotNegative | None
    nees: NotNegative | None


class CauseForm(Form):
    """Of `Cause`."""

    quantity: Text
    name: Text
    N: NotNegative | None
    K: NotNegative | None
    N_factor: NotNegative | None
    K_factor: NotNegative | None


class CertificateForm(Form):
    """Of `Certificate`; its numbers have forms of their own."""

    numbers: dict[str, Any]
    recommended: dict[str, Any]
    checks: Annotated[Sequence[CheckForm], Field(min_length=1, max_length=10_000)]
    causes: Annotated[Sequence[CauseForm], Field(max_length=1000)]
    notices: Notices
