"""A log ready for the filter, to be filtered again under other assumptions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt

from gmwm._core.distributions import norm
from gmwm._core.typing import FloatArray
from gmwm.ins import tuning
from gmwm.ins.field.measured import Measured
from gmwm.ins.field.start import Alignment, align, mean_sd, started
from gmwm.ins.filter import KINDS, Aiding, FilterInnovations, Fixes, InitialSd, Solution, navigate
from gmwm.ins.geometry import gravity_at, matrix_from_rpy, offset
from gmwm.ins.imu import AXES, Imu, SensorModels
from gmwm.ins.simulation import InnovationTest, chi_square_ratio, lag_one
from gmwm.ins.trajectory import NavState
from gmwm.process import Model, Process

Shift = Callable[[FloatArray], FloatArray]
"""By how much later the stamps of fixes are, s, of their times."""


@dataclass(frozen=True, eq=False)
class Replay:
    """What a filter of real data starts from.

    imu: From the first epoch of the filter on.
    state: At that epoch.
    aiding: On the time of ``imu``.
    stood: Time at rest of which the gyros' mean is subtracted, s; their ``bias_sd`` is how well it
        is known then. 0 if there is none.
    turned: Time over which the gyros turned the heading back to the start, s.
    """

    imu: Imu
    state: NavState
    sd: InitialSd
    models: SensorModels
    aiding: Aiding
    stood: float = 0.0
    turned: float = 0.0

    @classmethod
    def of(cls, measured: Measured, alignment: Alignment) -> Replay:
        """Real data from where they are aligned."""
        imu, aiding = started(measured.imu, measured.aiding, alignment)
        models = measured.sensors
        if alignment.gyro_bias_sd is not None:
            known = dict.fromkeys(AXES[:3], alignment.gyro_bias_sd)
            models = replace(models, bias_sd={**models.bias_sd, **known})
        return cls(
            imu, alignment.state, alignment.sd, models, aiding, alignment.stood, alignment.turned
        )

    # -- what comes of it -------------------------------------------------------------------------

    def solution(self, interval: float, before: tuple[float, ...] = ()) -> Solution:
        """The filter's solution every ``interval`` (s), and ``before`` the fixes of some times."""
        return navigate(
            self.imu, self.state, self.models, self.aiding, initial_sd=self.sd, interval=interval,
            before=before,
        )  # fmt: skip

    @cached_property
    def innovations(self) -> FilterInnovations:
        """Of all fixes."""
        return self.solution(self.imu.n * self.imu.dt).innovations

    @cached_property
    def track(self) -> Solution:
        """The solution where fixes are moved along it."""
        return self.solution(tuning.TRACK_STEP)

    @cached_property
    def standard(self) -> FloatArray:
        """Innovations in their expected standard deviations, (E, 3)."""
        return self.innovations.standard

    @cached_property
    def log_likelihood(self) -> float:
        """Of all fixes by their innovations, but for a constant; -inf if the filter diverged.

        The innovations of a filter that is right are white, so that the density of the fixes is the
        product of theirs (Schweppe 1965, *IEEE Trans. Inf. Theory* 11, 61-70).
        """
        standard = self.standard
        if np.any(np.all(np.isnan(standard), axis=1)):
            return -np.inf
        return float(-0.5 * np.nansum(standard**2 + 2.0 * np.log(self.innovations.sd)))

    @property
    def log_likelihood_of_one(self) -> float:
        """By the mean of all fixes."""
        return self.log_likelihood / max(self.standard.shape[0], 1)

    @property
    def is_lost(self) -> bool:
        """Whether errors may be beyond what the innovations show in proportion."""
        sizes = [self.test(kind).nis.value for kind in self.kinds()]
        return not np.isfinite(self.log_likelihood) or max(sizes) > tuning.LOST

    def kinds(self) -> tuple[str, ...]:
        """Kinds of fixes that there are, whose innovations are judged."""
        return tuple(dict.fromkeys(
            each.kind for each in self.aiding.fixes if each.time.size and each.kind != "standstill"
        ))  # fmt: skip

    def test(self, kind: str | None = None) -> InnovationTest:
        """Size and whiteness of the innovations of a kind, or of all; see `innovation_sizes`."""
        return innovation_sizes(self.innovations, kind)

    # -- other assumptions ------------------------------------------------------------------------

    def later(self, shift: Shift) -> Replay:
        """Fixes with later stamps, and with them the one that made the initial state.

        What would leave the record stays at its end: only filters of the same fixes are compared.
        """
        fixes = []
        for each in self.aiding.fixes:
            time = np.clip(each.time + shift(each.time), 0.0, self.imu.n * self.imu.dt)
            order = np.argsort(time, kind="stable")
            value, sd = each.value[order], each.sd[order]
            fixes.append(replace(each, time=time[order], value=value, sd=sd))
        return self._from_then(shift, fixes)

    def along(self, shift: Shift) -> Replay:
        """Fixes moved along the track by as much, in place of their stamps.

        By the velocity of the filter, and by what the accelerometers measure in a second: less
        averages no noise, and the filter's own change of velocity has the noise of the fix in it.
        """
        track, dt = self.track, self.imu.dt
        total, turned = (
            np.cumsum(np.vstack([np.zeros(3), each]), axis=0)
            for each in (self.imu.velocity, self.imu.rotation)
        )
        fixes = []
        for each in self.aiding.fixes:
            seconds = shift(each.time)
            reach = 0.5 * np.maximum(np.abs(seconds), tuning.TRACK_STEP)
            middle = each.time + 0.5 * seconds
            ends = (np.clip(middle + by, 0.0, self.imu.n * dt) for by in (-reach, reach))
            first, last = (np.rint(end / dt).astype(int) for end in ends)
            force = (total[last] - total[first]) / (np.maximum(last - first, 1) * dt)[:, None]
            middle_at = np.clip(np.rint(middle / dt), 0, self.imu.n).astype(int)
            near = np.searchsorted(track.time, middle_at * dt - 0.5 * tuning.TRACK_STEP)
            near = np.clip(near, 0, track.time.size - 1)
            # The track's attitude there, and what the vehicle turns by from then on.
            since = np.rint(track.time[near] / dt).astype(int)
            force += np.cross(turned[middle_at] - turned[since], force)
            change = seconds[:, None] * np.einsum("eij,ej->ei", track.matrix[near], force)
            change[:, 2] += seconds * gravity_at(np.sin(track.lla[near, 0]), track.lla[near, 2])
            velocity = np.stack(
                [np.interp(each.time, track.time, one) for one in track.velocity.T], axis=1
            )
            by = {"velocity": change, "standstill": 0.0 * change}.get(
                each.kind, seconds[:, None] * (velocity + 0.5 * change)
            )
            if each.kind == "height":
                by = -by[:, 2:]
            fixes.append(replace(each, value=each.moved(-by)))
        return self._from_then(shift, fixes)

    def _from_then(self, shift: Shift, fixes: list[Fixes]) -> Replay:
        state = self._where_at(-float(shift(np.zeros(1))[0]))
        return replace(self, state=state, aiding=replace(self.aiding, fixes=tuple(fixes)))

    def _where_at(self, seconds: float) -> NavState:
        """The initial state some time later; earlier if negative."""
        state = self.state
        if self.stood > 0.0:  # it stands there
            return state
        samples = max(round(abs(seconds) / self.imu.dt), 1)
        force = np.mean(self.imu.velocity[:samples], axis=0) / self.imu.dt
        acceleration = matrix_from_rpy(state.rpy) @ force
        acceleration[2] += gravity_at(np.sin(state.lla[0]), state.lla[2])
        lla = offset(state.lla, (state.velocity + 0.5 * acceleration * seconds) * seconds)
        return replace(state, lla=lla, velocity=state.velocity + acceleration * seconds)

    def with_arm_longer(self, by: FloatArray) -> Replay:
        """A lever arm longer by a vector, m."""
        arm = np.asarray(self.aiding.lever_arm) + by
        lla = offset(self.state.lla, -matrix_from_rpy(self.state.rpy) @ by)
        return replace(
            self, state=replace(self.state, lla=lla), aiding=replace(self.aiding, lever_arm=arm)
        )

    def turned_by(self, by: float, sd: float | None = None) -> Replay:
        """An initial heading farther by an angle, rad, known to ``sd``."""
        rpy = self.state.rpy + np.array([0.0, 0.0, by])
        heading = self.sd.heading if sd is None else sd
        return replace(
            self, state=replace(self.state, rpy=rpy), sd=replace(self.sd, heading=heading)
        )

    def with_factors(self, kind: str, factors: tuple[float, ...] | FloatArray) -> Replay:
        """What the axes of a kind of sensors measure times factors; levelled by the accelerometers
        anew.
        """
        turn = np.array(factors)
        if kind == "gyro":
            return replace(self, imu=replace(self.imu, rotation=self.imu.rotation * turn))
        x, y, z = -turn * matrix_from_rpy(self.state.rpy)[2]
        rpy = np.array([np.arctan2(-y, -z), np.arctan2(x, np.hypot(y, z)), self.state.rpy[2]])
        imu = replace(self.imu, velocity=self.imu.velocity * turn)
        return replace(self, imu=imu, state=replace(self.state, rpy=rpy))

    def anywhere(self) -> Replay:
        """A start that the first fix does not show: it is an outlier."""
        return replace(self, sd=replace(self.sd, position=tuning.ANYWHERE))

    def with_fixes_scaled(self, factor: float, kind: str) -> Replay:
        """Standard deviations of the fixes of a kind times ``factor``, the first one's too."""
        sd = self.sd
        if kind == "position":
            sd = replace(sd, position=factor * sd.position)
        fixes = tuple(
            replace(each, sd=factor * each.sd) if each.kind == kind else each
            for each in self.aiding.fixes
        )
        return replace(self, sd=sd, aiding=replace(self.aiding, fixes=fixes))

    def coloured(self, sd: FloatArray, tau: float) -> Replay:
        """Positions with a Gauss-Markov error."""
        return replace(self, aiding=replace(self.aiding, coloured_sd=sd, coloured_tau=tau))

    def with_sensors_scaled(self, factor: float, kind: str, white: bool) -> Replay:
        """White noise, or else all slow terms and the constant, of a kind of sensors scaled."""
        models, bias = dict(self.models.models), dict(self.models.bias_sd)
        averaged = kind == "gyro" and self.stood > 0.0
        for axis in AXES:
            if axis.startswith(kind):
                terms = models[axis].terms
                models[axis] = Model(tuple(
                    _scaled(term, factor) if term.is_white is white else term for term in terms
                ))  # fmt: skip
                bias[axis] *= 1.0 if white or averaged else factor
        scaled, sd = SensorModels(models, bias), self.sd
        if averaged:
            # The mean at rest, and the heading that was turned back less it, are as far off as the
            # noise makes them, not as the constant was.
            before, after = (
                mean_sd(each, kind, self.stood, self.imu.dt) for each in (self.models, scaled)
            )

            def instead(known: float, time: float = 1.0) -> float:
                rest = max(known**2 - (time * before) ** 2, 0.0)
                return float(np.hypot(np.sqrt(rest), time * after))

            for axis in AXES[:3]:
                bias[axis] = instead(bias[axis])
            sd = replace(sd, heading=instead(sd.heading, self.turned))
        return replace(self, models=SensorModels(models, bias), sd=sd)

    def without(self, rejected: dict[str, npt.NDArray[np.bool_]]) -> Replay:
        """Without some fixes; a mask for each kind."""
        fixes = tuple(
            each.part(~rejected[each.kind]) if each.kind in rejected else each
            for each in self.aiding.fixes
        )
        return replace(self, aiding=replace(self.aiding, fixes=fixes))

    def diagnosed(self) -> Replay:
        """The part in which faults are looked for."""
        return self.within(tuning.LARGEST_OFFSET + tuning.OFFSET_MARGIN, tuning.DIAGNOSED)

    def within(self, margin: float, longest: float) -> Replay:
        """Without fixes near the ends and what comes after ``longest`` (s); no fix is rejected."""
        n = min(self.imu.n, round(longest / self.imu.dt))
        imu = Imu(self.imu.dt, self.imu.rotation[:n], self.imu.velocity[:n])
        end = n * imu.dt - margin
        fixes = tuple(
            each.part((each.time > margin) & (each.time < end)) for each in self.aiding.fixes
        )
        return replace(self, imu=imu, aiding=replace(self.aiding, fixes=fixes, gate=None))


def alignment_of(measured: Measured) -> Alignment:
    """Where a filter of real data starts; `align` with all that is known."""
    return align(
        measured.imu, measured.aiding, measured.sensors, measured.heading, measured.heading_sd,
        measured.attitude, measured.attitude_sd,
    )  # fmt: skip


def innovation_sizes(innovations: FilterInnovations, kind: str | None = None) -> InnovationTest:
    """Size and whiteness of the innovations of a kind, or of all together."""
    found = [KINDS[kind]] if kind else list(np.unique(innovations.kind))
    found = [each for each in found if each != KINDS["standstill"]]
    parts = [innovations.standard[innovations.kind == each] for each in found]
    seen = np.concatenate([part[np.isfinite(part)] for part in parts])
    return InnovationTest(chi_square_ratio(seen**2, 1), float(2.0 * norm.sf(abs(lag_one(parts)))))


def _scaled(term: Process, factor: float) -> Process:
    """A term with ``factor`` times the standard deviation."""
    linear = term.linear_parameter
    if linear is None:
        return term
    value = float(term.values[linear.name] or 0.0) * factor ** (2.0 / linear.power)
    return term.with_values(**{linear.name: value})
