"""A log ready for the filter, to be filtered again under other assumptions, or smoothed."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from gmwm._core.distributions import norm
from gmwm._core.typing import BoolArray, FloatArray, IntArray
from gmwm.ins import tuning
from gmwm.ins.filter.aiding import Aiding, Fixes
from gmwm.ins.filter.covariance_kernels import NAVIGATION, measurement_update, propagate, transition
from gmwm.ins.filter.filter import Filter, FilterInnovations, InitialSd, Outputs, Solution, navigate
from gmwm.ins.filter.measurements import KINDS, observe
from gmwm.ins.filter.records import Events, Kinematics, Transition, new_transition
from gmwm.ins.geometry import gravity_at, matrix_from_rpy, offset
from gmwm.ins.increments import Imu
from gmwm.ins.logs.alignment import Alignment, align, started
from gmwm.ins.logs.measured import Measured
from gmwm.ins.sensors import AXES, SensorModels
from gmwm.ins.simulation.consistency import InnovationTest, chi_square_ratio, lag_one
from gmwm.ins.trajectory.trajectory import NavState


@dataclass(frozen=True, eq=False)
class Replay:
    """The inputs of a filter of real data, from the first epoch of the filter on.

    is_at_rest: Whether the vehicle stands still at that epoch.
    start: Time of that epoch since the first one of the record, s.
    """

    imu: Imu
    state: NavState
    sd: InitialSd
    models: SensorModels
    aiding: Aiding
    is_at_rest: bool = False
    start: float = 0.0

    @classmethod
    def of(cls, measured: Measured, alignment: Alignment | None = None) -> Replay:
        """Real data from the alignment on."""
        alignment = alignment or align(measured)
        imu, aiding = started(measured, alignment)
        models = measured.sensors
        if alignment.gyro_bias_sd is not None:
            known = dict.fromkeys(AXES[:3], alignment.gyro_bias_sd)
            models = replace(models, bias_sd={**models.bias_sd, **known})
        found = cls(imu, alignment.state, alignment.sd, models, aiding)
        return replace(found, is_at_rest=alignment.stood > 0.0, start=alignment.epoch * imu.dt)

    def solution(self, interval: float, before: tuple[float, ...] = ()) -> Solution:
        """The filter's solution every ``interval`` (s), and ``before`` the fixes of some times."""
        given = (self.imu, self.state, self.models, self.aiding)
        return navigate(*given, initial_sd=self.sd, interval=interval, before=before)

    @cached_property
    def innovations(self) -> FilterInnovations:
        """Innovations of all fixes."""
        return self.solution(self.imu.n * self.imu.dt).innovations

    @cached_property
    def track(self) -> Solution:
        """The solution along which fixes are moved."""
        return self.solution(tuning.TRACK_STEP)

    @property
    def _is_fix(self) -> BoolArray:
        """Innovations that are compared: a standstill may be none, and is gated all the time."""
        return np.asarray(self.innovations.kind != KINDS["standstill"])

    @cached_property
    def standard(self) -> FloatArray:
        """Innovations of the fixes in their expected standard deviations, (E, 3)."""
        return self.innovations.standard[self._is_fix]

    @cached_property
    def log_likelihood(self) -> float:
        """Log-likelihood of all fixes, up to a constant; -inf if the filter diverged.

        The innovations of a correct filter are white, so that the density of the fixes is the
        product of theirs (Schweppe 1965, *IEEE Trans. Inf. Theory* 11, 61-70).
        """
        standard = self.standard
        if np.any(np.all(np.isnan(standard), axis=1)):
            return -np.inf
        sd = self.innovations.sd[self._is_fix]
        return float(-0.5 * np.nansum(standard**2 + 2.0 * np.log(sd)))

    @property
    def is_lost(self) -> bool:
        """Whether errors may be too large to show in the innovations in proportion."""
        sizes = [self.test(kind).nis.value for kind in self.kinds]
        return not np.isfinite(self.log_likelihood) or max(sizes) > tuning.LOST

    @property
    def kinds(self) -> tuple[str, ...]:
        """Kinds of fixes, but standstills."""
        fixes = [each for each in self.aiding.fixes if each.time.size]
        return tuple(dict.fromkeys(e.kind for e in fixes if e.kind != "standstill"))

    def test(self, kind: str | None = None) -> InnovationTest:
        """Size and whiteness of the innovations of a kind, or of all."""
        return innovation_sizes(self.innovations, kind)

    def later(self, seconds: float) -> Replay:
        """Fixes with later stamps, and with them the one that made the initial state.

        Fixes that would leave the record stay at its end: only filters of the same fixes compare.
        """
        end = self.imu.n * self.imu.dt
        fixes = [
            replace(each, time=np.clip(each.time + seconds, 0.0, end)) for each in self.aiding.fixes
        ]
        return self._with_fixes(fixes, -seconds)

    def slower(self, by: float) -> Replay:
        """A clock of the IMU that is slower by a share: samples last longer, and add up to more.

        It is right at the first epoch of the record.
        """
        longer, imu = 1.0 + by, self.imu
        imu = Imu(imu.dt * longer, imu.rotation * longer, imu.velocity * longer)
        found = replace(self, imu=imu, start=self.start * longer)
        return found.later(-by * self.start)

    def along(self, seconds: float) -> Replay:
        """Fixes moved along the track instead of later stamps.

        By the velocity of the filter, and by the accelerometers over a second: less averages no
        noise, and the filter's own change of velocity contains the noise of the fix.
        """
        track, dt = self.track, self.imu.dt
        summed, turned = (
            np.cumsum(np.vstack([np.zeros(3), each]), axis=0)
            for each in (self.imu.velocity, self.imu.rotation)
        )
        reach = 0.5 * max(abs(seconds), tuning.TRACK_STEP)
        fixes = []
        for each in self.aiding.fixes:
            middle = each.time + 0.5 * seconds
            first, at, last = (
                np.rint(np.clip(middle + by, 0.0, self.imu.n * dt) / dt).astype(int)
                for by in (-reach, 0.0, reach)
            )
            force = (summed[last] - summed[first]) / (np.maximum(last - first, 1) * dt)[:, None]
            near = np.searchsorted(track.time, at * dt - 0.5 * tuning.TRACK_STEP)
            near = np.clip(near, 0, track.time.size - 1)
            # The track's attitude there, and the turn of the vehicle from then on.
            since = np.rint(track.time[near] / dt).astype(int)
            force += np.cross(turned[at] - turned[since], force)
            change = seconds * np.einsum("eij,ej->ei", track.matrix[near], force)
            change[:, 2] += seconds * gravity_at(np.sin(track.lla[near, 0]), track.lla[near, 2])
            velocity = np.stack(
                [np.interp(each.time, track.time, one) for one in track.velocity.T], axis=1
            )
            way = seconds * (velocity + 0.5 * change)
            by = {
                "position": way,
                "velocity": change,
                "height": -way[:, 2:],
                "standstill": 0.0 * way,
            }
            fixes.append(replace(each, value=each.moved(-by[each.kind])))
        return self._with_fixes(fixes, -seconds)

    def _with_fixes(self, fixes: list[Fixes], seconds: float) -> Replay:
        """Other fixes, and the initial state some time later; earlier if negative."""
        state = self.state
        if not self.is_at_rest:
            samples = max(round(abs(seconds) / self.imu.dt), 1)
            force = np.mean(self.imu.velocity[:samples], axis=0) / self.imu.dt
            acceleration = matrix_from_rpy(state.rpy) @ force
            acceleration[2] += gravity_at(np.sin(state.lla[0]), state.lla[2])
            way = (state.velocity + 0.5 * acceleration * seconds) * seconds
            velocity = state.velocity + acceleration * seconds
            state = replace(state, lla=offset(state.lla, way), velocity=velocity)
        return replace(self, state=state, aiding=replace(self.aiding, fixes=tuple(fixes)))

    def with_arm_longer(self, by: FloatArray) -> Replay:
        """A lever arm longer by a vector, m."""
        arm = np.asarray(self.aiding.lever_arm) + by
        lla = offset(self.state.lla, -matrix_from_rpy(self.state.rpy) @ by)
        aiding = replace(self.aiding, lever_arm=arm)
        return replace(self, state=replace(self.state, lla=lla), aiding=aiding)

    def turned_by(self, by: float, sd: float | None = None) -> Replay:
        """An initial heading that is larger by an angle, rad, with standard deviation ``sd``."""
        rpy = self.state.rpy + np.array([0.0, 0.0, by])
        sd = self.sd.heading if sd is None else sd
        return replace(self, state=replace(self.state, rpy=rpy), sd=replace(self.sd, heading=sd))

    def with_signs(self, kind: str, signs: FloatArray) -> Replay:
        """Axes of a kind of sensors times signs; levelled by the accelerometers anew."""
        if kind == "gyro":
            return replace(self, imu=replace(self.imu, rotation=self.imu.rotation * signs))
        x, y, z = -signs * matrix_from_rpy(self.state.rpy)[2]
        rpy = np.array([np.arctan2(-y, -z), np.arctan2(x, np.hypot(y, z)), self.state.rpy[2]])
        imu = replace(self.imu, velocity=self.imu.velocity * signs)
        return replace(self, imu=imu, state=replace(self.state, rpy=rpy))

    def without(self, rejected: dict[str, BoolArray]) -> Replay:
        """Without some fixes; a mask for each kind."""
        fixes = tuple(
            each.part(~rejected[each.kind]) if each.kind in rejected else each
            for each in self.aiding.fixes
        )
        return replace(self, aiding=replace(self.aiding, fixes=fixes))

    def within(self, margin: float, longest: float) -> Replay:
        """Without fixes near the ends and anything after ``longest`` (s); no fix is rejected."""
        n = min(self.imu.n, round(longest / self.imu.dt))
        imu = Imu(self.imu.dt, self.imu.rotation[:n], self.imu.velocity[:n])
        end = n * imu.dt - margin
        fixes = tuple(
            each.part((each.time > margin) & (each.time < end)) for each in self.aiding.fixes
        )
        return replace(self, imu=imu, aiding=replace(self.aiding, fixes=fixes, gate=None))


def innovation_sizes(innovations: FilterInnovations, kind: str | None = None) -> InnovationTest:
    """Size and whiteness of the innovations of a kind, or of all but standstills."""
    kinds = [KINDS[kind]] if kind else list(np.unique(innovations.kind))
    parts = [
        innovations.standard[innovations.kind == each]
        for each in kinds
        if each != KINDS["standstill"]
    ]
    seen = np.concatenate([part[np.isfinite(part)] for part in parts])
    return InnovationTest(chi_square_ratio(seen**2, 1), float(2.0 * norm.sf(abs(lag_one(parts)))))


# -- smoothing ------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Smoothed:
    """Positions (K, 3) and covariance (K, 3, 3), m^2, at K times, and the forward solution."""

    lla: FloatArray
    covariance: FloatArray
    solution: Solution


class _Update(NamedTuple):
    """One scalar measurement: its row, gain and innovation with its variance."""

    row: FloatArray
    gain: FloatArray
    innovation: float
    variance: float


def smooth(replay: Replay, at: FloatArray) -> Smoothed:
    """Positions at rising times, s, from the fixes before and after; NaN if the filter diverged.

    The fixed-interval smoother of Rauch, Tung & Striebel (1965, *AIAA Journal* 3, 1445-1450) in the
    form of Bryson & Frazier, which inverts no covariance (Bierman 1973, *Automatica* 9, 503-511):
    backwards, an adjoint vector collects the innovations, and a matrix their information.
    """
    imu, step = replay.imu, tuning.SMOOTHER_STEP
    ready = Filter.of(replay.models, replay.aiding, imu.dt, step)
    outputs = Outputs.every(step, imu.dt, imu.n, also=at)
    events = replay.aiding.events(imu.dt, imu.n)
    solution = ready.run(imu, replay.state, replay.sd, events, outputs)
    wanted = np.rint(at / imu.dt).astype(np.int64)
    if solution.diverged_at is not None:
        return Smoothed(np.full((at.size, 3), np.nan), np.full((at.size, 3, 3), np.nan), solution)
    P = ready.covariance(replay.state, replay.sd)
    forward = _Forward(replay, ready, events, solution, P)
    kept = forward.run(set(wanted.tolist()))
    n = P.shape[0]
    adjoint, information = np.zeros(n), np.zeros((n, n))
    lla, covariance = np.empty((at.size, 3)), np.empty((at.size, 3, 3))
    place = {epoch: i for i, epoch in enumerate(wanted.tolist())}
    for before, epoch, updates in reversed(forward.steps):
        if epoch in place:
            i, C = place[epoch], kept[epoch]
            error = -C[:3] @ adjoint
            here = solution.lla[np.searchsorted(forward.nodes, epoch)]
            lla[i] = offset(here, -error)
            covariance[i] = C[:3, :3] - C[:3] @ information @ C[:, :3]
        for update in reversed(updates):
            h, K = update.row, update.gain
            adjoint = adjoint - h * (K @ adjoint + update.innovation / update.variance)
            left = information - np.outer(h, K @ information)
            information = left - np.outer(left @ K, h) + np.outer(h, h) / update.variance
        for first, count in reversed(forward.strides(before, epoch)):
            advance = forward.transition(first, count)[0]
            adjoint = advance.T @ adjoint
            information = advance.T @ information @ advance
    return Smoothed(lla, covariance, solution)


@dataclass(frozen=True, eq=False)
class _Forward:
    """The covariance along a solution, and the measurements for the way back."""

    replay: Replay
    ready: Filter
    events: Events
    solution: Solution
    P: FloatArray
    steps: list[tuple[int, int, list[_Update]]] = field(default_factory=list)

    @cached_property
    def nodes(self) -> IntArray:
        """Epochs of the solution."""
        return np.rint(self.solution.time / self.replay.imu.dt).astype(np.int64)

    def run(self, wanted: set[int]) -> dict[int, FloatArray]:
        """Run forwards; the covariance after the measurements of the wanted epochs."""
        epochs = np.union1d(self.nodes, self.events.epoch)
        table, kept, before = self.ready.states.table, {}, int(epochs[0])
        for epoch in epochs.tolist():
            for first, count in self.strides(before, epoch):
                propagate(self.P, self.transition(first, count)[1], table, count)
            first, last = np.searchsorted(self.events.epoch, [epoch, epoch + 1])
            updates = [each for event in range(first, last) for each in self.update(event, epoch)]
            self.steps.append((before, epoch, updates))
            before = epoch
            if epoch in wanted:
                kept[epoch] = self.P.copy()
        return kept

    def strides(self, before: int, epoch: int) -> list[tuple[int, int]]:
        """First epoch and number of samples of each step of the covariance between two epochs."""
        stride = self.ready.settings.stride
        return [(k, min(stride, epoch - k)) for k in range(before, epoch, stride)]

    def nominal(self, epoch: float) -> tuple[FloatArray, FloatArray, FloatArray, int]:
        i = int(np.clip(np.searchsorted(self.nodes, epoch, side="right") - 1, 0, None))
        return self.solution.velocity[i], self.solution.lla[i], self.solution.matrix[i], i

    def transition(self, epoch: int, count: int) -> tuple[FloatArray, Transition]:
        """Transition of all states over some samples, and its parts: navigation, and by sensors."""
        v, lla, C, i = self.nominal(epoch + 0.5 * count)
        if i + 1 < self.nodes.size:
            step = max(int(self.nodes[i + 1] - self.nodes[i]), 1)
            share = (epoch + 0.5 * count - self.nodes[i]) / step
            v = (1.0 - share) * v + share * self.solution.velocity[i + 1]
            C = (1.0 - share) * C + share * self.solution.matrix[i + 1]
        change = new_transition()
        transition(Kinematics(np.ascontiguousarray(C), v, lla), count * self.replay.imu.dt, change)
        table, m = self.ready.states.table, self.ready.states.m
        whole, index = np.zeros((NAVIGATION + m, NAVIGATION + m)), np.arange(m)
        whole[:NAVIGATION, :NAVIGATION] = change.A
        whole[NAVIGATION + index, NAVIGATION + index] = table.phi[count]
        own = index[table.partner != index]
        whole[NAVIGATION + own, NAVIGATION + table.partner[own]] = table.phi_off[count][own]
        own = np.flatnonzero(table.axis >= 0)
        whole[:NAVIGATION, NAVIGATION + own] = change.B[:, table.axis[own]] * table.gain[count][own]
        return whole, change

    def update(self, event: int, epoch: int) -> list[_Update]:
        """Update the covariance by the components of a fix, with the filter's innovations."""
        innovations = self.solution.innovations
        kind = int(innovations.kind[event])
        v, lla, C, _ = self.nominal(epoch)
        at = Kinematics(np.ascontiguousarray(C), v, lla)
        last = min(max(epoch - 1, 0), self.replay.imu.n - 1)
        rate = self.replay.imu.rotation[last] / self.replay.imu.dt
        found, n = [], self.P.shape[0]
        for component in range(3):
            value, sd = innovations.value[event, component], self.events.sd[event, component]
            if not (np.isfinite(value) and innovations.used[event]):
                continue
            row, gain = np.zeros(n), np.zeros(n)
            lever = np.asarray(self.replay.aiding.lever_arm)
            observe(kind, component, self.events.value[event], at, rate, lever, row)
            state = int(self.ready.settings.noise_states[kind, component])
            if state >= 0:
                row[NAVIGATION + state] = -1.0
            # The filter's own variance, which allows for more than the noise of the fix.
            predicted = float(row @ self.P @ row)
            noise = max(float(innovations.sd[event, component] ** 2) - predicted, float(sd**2))
            _, variance = measurement_update(self.P, row, noise, 0.0, np.zeros(n), gain)
            found.append(_Update(row, gain, float(value), float(variance)))
        return found
