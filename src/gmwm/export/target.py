"""A consumer of the numbers, and how its file is put together."""

from __future__ import annotations

import os
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import KW_ONLY, dataclass
from typing import Any

from gmwm._core import checks
from gmwm._core.files import written
from gmwm.errors import InputError
from gmwm.export import tuning
from gmwm.export.comments import above, below, comment, wrapped
from gmwm.export.found import imu_of
from gmwm.export.imu import Imu
from gmwm.filter_numbers import FORMS


@dataclass(frozen=True)
class Target(ABC):
    """A file that some program reads.

    name: As users write it.
    title: The program.
    file: The file, or the place in it, where the numbers go.
    convention: What the values are, in N, K, sigma, tau and the rate f of the samples.
    source: Where the program's own source, or its manual, defines that.
    form: The form of the numbers that it holds.
    horizon: Time without aiding unless another is given, s.
    warnings: What to know before use.
    """

    name: str
    title: str
    file: str
    convention: str
    source: str
    _: KW_ONLY
    form: str = "N+K"
    horizon: float = tuning.HORIZON
    warnings: tuple[str, ...] = ()

    @abstractmethod
    def export(self, given: Sequence[Any], horizon: float | None, form: str | None) -> str:
        """The file of calibrations or of numbers.

        Raises InputError if they do not hold what it needs.
        """

    def save(
        self,
        path: str | os.PathLike[str],
        given: Sequence[Any],
        horizon: float | None,
        form: str | None,
    ) -> str:
        """Write the file whole or not at all; returns its text."""
        text = self.export(given, horizon, form)
        with written(path) as stream:
            stream.write(text)
        return text


@dataclass(frozen=True)
class ImuFile(Target):
    """Numbers of gyros and accelerometers, between comments that say what they are.

    body: Lines between the comments, of an `Imu`; of files in JSON, the object.
    shared: Whether the axes of a sensor have one value.
    one_tau: Whether all axes have one correlation time.
    mark: What a comment begins with.
    head: Lines that must stand first.
    """

    body: Callable[[Imu], Any]
    _: KW_ONLY
    shared: bool = False
    one_tau: bool = False
    mark: str = "#"
    head: tuple[str, ...] = ()

    def above(self, imu: Imu) -> list[str]:
        """Lines of comment above the numbers, without the mark."""
        name = f"{self.title}, {self.file}"
        return [*above(imu, name), *(line for text in self.warnings for line in wrapped(text))]

    def below(self, imu: Imu) -> list[str]:
        """Lines of comment below the numbers, without the mark."""
        return below(imu, f"{self.convention} ({self.source})")

    def text(self, imu: Imu) -> str:
        """The whole file."""
        first, last = (comment(each(imu), self.mark) for each in (self.above, self.below))
        return "\n".join([*self.head, *first, *self.body(imu), "", *last]) + "\n"

    def export(self, given: Sequence[Any], horizon: float | None, form: str | None) -> str:
        if form is not None and checks.choice("form", form, FORMS) != self.form:
            raise InputError(f"form {form}: {self.title} holds {self.form} only")
        try:
            imu = imu_of(given, self.form, horizon, self.horizon, self.shared, one_tau=self.one_tau)
        except InputError as error:
            raise InputError(f"{self.title}: {error}", error.code) from None
        return self.text(imu)
