"""Positions from all fixes, those before and those after: the reference where there is no truth.

The fixed-interval smoother of Rauch, Tung & Striebel (1965, *AIAA Journal* 3, 1445-1450) in the
form of Bryson & Frazier, which inverts no covariance (Bierman 1973, *Automatica* 9, 503-511):
backwards, an adjoint vector collects the innovations, and a matrix their information.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np

from gmwm._core.typing import FloatArray, IntArray
from gmwm.ins import tuning
from gmwm.ins.filter import (
    NAVIGATION,
    Events,
    Filter,
    Kinematics,
    Outputs,
    Solution,
    Transition,
    measurement_update,
    new_transition,
    observe,
    propagate,
    transition,
)
from gmwm.ins.geometry import offset
from gmwm.ins.logs.replay import Replay


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
    """Smooth a log at rising times, s; NaN if the forward filter diverged."""
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
    """The covariance along a solution, and the measurements for the way back.

    Transitions are computed again on the way back: kept, they would be most of the memory.
    """

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
        stride = self.ready.stride
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
            h, row, gain = np.zeros(NAVIGATION), np.zeros(n), np.zeros(n)
            lever = np.asarray(self.replay.aiding.lever_arm)
            observe(kind, component, self.events.value[event], at, rate, lever, h)
            row[:NAVIGATION] = h
            state = int(self.ready.noise_states[kind, component])
            if state >= 0:
                state += NAVIGATION
                row[state] = -1.0
            # The filter's own variance, which allows for more than the noise of the fix.
            predicted = float(row @ self.P @ row)
            noise = max(float(innovations.sd[event, component] ** 2) - predicted, float(sd**2))
            _, variance = measurement_update(self.P, h, state, noise, 0.0, np.zeros(n), gain)
            found.append(_Update(row, gain, float(value), float(variance)))
        return found
