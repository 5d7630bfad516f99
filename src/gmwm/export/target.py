"""A consumer of the numbers: what its file holds, and how the file is put together."""

from __future__ import annotations

import json
import os
from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any, ClassVar

from gmwm._core import checks
from gmwm._core.files import write_text
from gmwm.calibration import Calibration
from gmwm.errors import InputError
from gmwm.export.comments import comment, notes, purpose, wrapped
from gmwm.export.imu import ImuNumbers
from gmwm.export.keys import Keys
from gmwm.export.numbers import imu_of, numbers_for
from gmwm.filter_numbers import FORMS, usable


class Target(ABC):
    """A file that some program reads; a subclass sets the class attributes.

    name: As users write it.
    title: The program.
    file: The file, or the place in it, where the numbers go.
    convention: What the values are, in N, K, sigma, tau and the rate f of the samples.
    source: Where the program's own source, or its manual, defines that.
    form: The form of the numbers that it holds.
    caution: What to know before use, in a line of the file.
    warnings: More of it, for the explanation.
    file_name: How `gmwm calibrate` calls the file; by default name.yaml.
    to_copy: Title by which reports offer the text to copy; empty where they do not.
    keys: By which the numbers are read back; None if they cannot be.
    """

    name: ClassVar[str]
    title: ClassVar[str]
    file: ClassVar[str]
    convention: ClassVar[str]
    source: ClassVar[str]
    form: ClassVar[str] = "N+K"
    caution: ClassVar[str] = ""
    warnings: ClassVar[tuple[str, ...]] = ()
    file_name: ClassVar[str] = ""
    to_copy: ClassVar[str] = ""
    keys: ClassVar[Keys | None] = None

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        if "name" in vars(cls) and not cls.file_name:
            cls.file_name = f"{cls.name}.yaml"

    @abstractmethod
    def export(self, given: Sequence[Any], horizon: float | None, form: str | None) -> str:
        """The file of calibrations or of numbers.

        Raises InputError if they lack something that the file needs.
        """

    @abstractmethod
    def explain(
        self, given: Sequence[Any], horizon: float | None = None, form: str | None = None
    ) -> str:
        """What the values of the file are and mean; errors as of `export`."""

    def about(self) -> list[str]:
        """Name, caution, warnings and convention, as texts."""
        texts = [self.caution, *self.warnings, f"{self.convention} ({self.source})"]
        return [f"{self.title}, {self.file}", *filter(None, texts)]

    def save(
        self, path: str | os.PathLike[str], given: Sequence[Any], horizon: float | None, form: Any
    ) -> str:
        """Write the file whole or not at all; returns its text."""
        text = self.export(given, horizon, form)
        write_text(path, text)
        return text


class ImuFile(Target):
    """Numbers of gyros and accelerometers, below comments that say what they are.

    shared: Whether the axes of a sensor have one value.
    one_tau: Whether all axes have one correlation time.
    mark: What a comment begins with.
    head: Lines that must stand first.
    """

    shared: ClassVar[bool] = False
    one_tau: ClassVar[bool] = False
    mark: ClassVar[str] = "#"
    head: ClassVar[tuple[str, ...]] = ()

    @abstractmethod
    def body(self, imu: ImuNumbers) -> Any:
        """Lines between the comments; of files in JSON, the object."""

    def text(self, imu: ImuNumbers) -> str:
        """The whole file."""
        lines = comment(notes(imu, self.title, self.caution), self.mark)
        return "\n".join([*self.head, *lines, *self.body(imu)]) + "\n"

    def export(self, given: Sequence[Any], horizon: float | None, form: str | None) -> str:
        return self.text(self._imu(given, horizon, form))

    def explain(
        self, given: Sequence[Any], horizon: float | None = None, form: str | None = None
    ) -> str:
        imu = self._imu(given, horizon, form)
        parts = [
            "\n".join(line for each in [*self.about(), *purpose(imu)] for line in wrapped(each))
        ]
        if self.shared:
            parts.append("The same for all axes of a sensor, as in the file:")
            own = [each for each in given if isinstance(each, Calibration)]
            parts += [usable(each, self.form, imu.horizon, shared=True).text("si") for each in own]
            parts.append("Each axis by itself, which the file does not hold:")
        sources = numbers_for(given, self.form, horizon, self.one_tau)
        return "\n\n".join([*parts, *(each.text("si") for each in sources)]) + "\n"

    def _imu(self, given: Sequence[Any], horizon: float | None, form: str | None) -> ImuNumbers:
        if form is not None and checks.choice("form", form, FORMS) != self.form:
            raise InputError(f"form {form}: {self.title} holds {self.form} only")
        try:
            return imu_of(given, self.form, horizon, shared=self.shared, one_tau=self.one_tau)
        except InputError as error:
            raise InputError(f"{self.title}: {error}", error.code) from None


class JsonFile(ImuFile):
    """A file in JSON, whose comments are an entry of their own at the end."""

    def text(self, imu: ImuNumbers) -> str:
        comments = notes(imu, self.title, self.caution)
        return json_text({**self.body(imu), "comment": comments}) + "\n"


def json_text(value: Any, indent: str = "") -> str:
    """JSON with an entry, or a line of text, on each line; matrices on one."""
    inner = indent + "  "
    if isinstance(value, dict):
        lines = [
            f"{inner}{json.dumps(key)}: {json_text(each, inner)}" for key, each in value.items()
        ]
        return "{\n" + ",\n".join(lines) + f"\n{indent}}}"
    if isinstance(value, list) and value and all(isinstance(each, str) for each in value):
        return "[\n" + ",\n".join(inner + json.dumps(each) for each in value) + f"\n{indent}]"
    return json.dumps(value, allow_nan=False)
