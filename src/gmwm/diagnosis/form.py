"""Form of a stored `Health`: what each key must hold."""

from __future__ import annotations

from typing import Annotated, Self

from pydantic import Field, model_validator

from gmwm._core.forms import Form, Notices, NotNegative, Positive, Rate, Samples, Text

_OR_LIST = Field(strict=False)  # JSON has no tuples

Index = Annotated[int, Field(ge=0)]


class RepetitionForm(Form):
    """Of `Repetition`."""

    times: Annotated[int, Field(ge=2)]
    first: Index

    @model_validator(mode="after")
    def _together(self) -> Self:
        if self.first >= self.times:
            raise ValueError("first is not below times")
        return self


class ChannelHealthForm(Form):
    """Of `ChannelHealth`."""

    lines: Annotated[list[Annotated[tuple[Positive, NotNegative], _OR_LIST]], _OR_LIST]
    resonances: Annotated[list[Annotated[tuple[Positive, Positive], _OR_LIST]], _OR_LIST]
    events: Annotated[list[Annotated[tuple[Index, Samples], _OR_LIST]], _OR_LIST]
    lsb: NotNegative
    outliers: Annotated[float, Field(ge=0.0, le=1.0)]
    held: Annotated[float, Field(ge=0.0, le=1.0)] = 0.0
    noise: NotNegative = 0.0
    repetition: RepetitionForm | None


class HealthForm(Form):
    """Of `Health`."""

    source: Text
    rate_hz: Rate
    n: Samples
    notices: Notices
    channels: dict[Text, ChannelHealthForm]

    @model_validator(mode="after")
    def _together(self) -> Self:
        for name, channel in self.channels.items():
            if any(not start < stop <= self.n for start, stop in channel.events):
                raise ValueError(f"an event of {name} is no interval of samples")
        return self
