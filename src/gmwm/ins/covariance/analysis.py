"""Covariance analysis: the true errors of a filter with a wrong model, without Monte Carlo."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from gmwm._core.notices import Notice
from gmwm._core.typing import FloatArray, IntArray
from gmwm.errors import InputError
from gmwm.ins import tuning
from gmwm.ins.covariance.analysis_kernels import run_both
from gmwm.ins.filter import (
    NAVIGATION,
    Filter,
    Outputs,
    SensorStates,
    modified,
    unmodified,
)
from gmwm.ins.geometry import matrix_from_rpy
from gmwm.ins.imu import Imu, SensorModels, emulate
from gmwm.ins.simulation import Scenario


@dataclass(frozen=True, eq=False)
class Analysis:
    """What a filter predicts, and what is true of it, at K epochs.

    Attributes
    ----------
    time : (K,) ndarray
        s.
    before : (K,) ndarray of bool
        Whether the measurements of the epoch are not in yet.
    predicted, actual : (K, 9, 9) ndarray
        Covariance of the errors of position (m), velocity (m/s) and attitude (rad): the filter's
        own, and the true one.
    sensor_predicted, sensor_actual : (K, 6, 6) ndarray
        Of the estimated errors of the sensors, rad/s and m/s^2.
    notices : tuple of Notice
        Outages that end with errors larger than can be predicted without runs.
    """

    time: FloatArray
    before: np.typing.NDArray[np.bool_]
    predicted: FloatArray
    actual: FloatArray
    sensor_predicted: FloatArray
    sensor_actual: FloatArray
    notices: tuple[Notice, ...] = ()

    @property
    def sd(self) -> FloatArray:
        """True standard deviations of the nine navigation errors, (K, 9)."""
        return np.sqrt(np.diagonal(self.actual, axis1=1, axis2=2))

    @property
    def predicted_sd(self) -> FloatArray:
        """Predicted standard deviations, (K, 9)."""
        return np.sqrt(np.diagonal(self.predicted, axis1=1, axis2=2))

    def index(self, time: float, *, before: bool = True) -> int:
        """Place of an epoch.

        Raises
        ------
        InputError
            If it was not kept.
        """
        found = np.flatnonzero((np.abs(self.time - time) < 1e-6) & (self.before == before))
        if found.size == 0:
            raise InputError(f"nothing was kept at {time:g} s: give the end of an outage")
        return int(found[0])

    def nees(self, part: slice = slice(0, 3)) -> FloatArray:
        """Expected normalised error squared per degree of freedom, (K,); 1 if consistent."""
        predicted, actual = self.predicted[:, part, part], self.actual[:, part, part]
        ratio = np.linalg.solve(predicted, actual)
        return np.asarray(np.trace(ratio, axis1=1, axis2=2) / predicted.shape[1])

    def score(self, part: slice = slice(0, 3)) -> FloatArray:
        """Expected negative logarithm of the predicted density at the truth, (K,)."""
        predicted = self.predicted[:, part, part]
        size = predicted.shape[1]
        log_det = np.linalg.slogdet(predicted)[1]
        return np.asarray(0.5 * (size * self.nees(part) + log_det + size * np.log(2.0 * np.pi)))


@dataclass(frozen=True, eq=False)
class Course:
    """A scenario cut into steps of the covariance: what does not depend on the models.

    epoch, samples: (S + 1,) of int.
    mid_matrix, mid_v, mid_lla, end_matrix, end_v, end_rate: See
        `gmwm.ins.covariance.analysis_kernels.run_both`.
    """

    scenario: Scenario
    outputs: Outputs
    epoch: IntArray
    samples: IntArray
    mid_matrix: FloatArray
    mid_v: FloatArray
    mid_lla: FloatArray
    end_matrix: FloatArray
    end_v: FloatArray
    end_rate: FloatArray

    @classmethod
    def of(cls, scenario: Scenario, imu: Imu | None = None) -> Course:
        """Cut a scenario; ``imu`` is that of its trajectory, error-free."""
        trajectory = scenario.trajectory
        imu = emulate(trajectory) if imu is None else imu
        stride = max(round(scenario.step / trajectory.dt), 1)
        outputs = scenario.outputs()
        asked = scenario.aiding.without(scenario.outages).events(trajectory.dt, trajectory.n).epoch
        epoch = _steps(np.union1d(asked, outputs.epoch), trajectory.n, stride)
        samples = np.diff(epoch, prepend=0)
        # The middle of an odd number of samples lies between two epochs.
        early = epoch - samples + samples // 2
        late = early + samples % 2

        def middle(values: FloatArray) -> FloatArray:
            return np.ascontiguousarray(0.5 * (values[early] + values[late]))

        rate = imu.rotation[np.maximum(epoch - 1, 0)] / trajectory.dt
        return cls(
            scenario=scenario,
            outputs=outputs,
            epoch=epoch,
            samples=samples,
            mid_matrix=middle(matrix_from_rpy(trajectory.rpy)),
            mid_v=middle(trajectory.velocity),
            mid_lla=middle(trajectory.lla),
            end_matrix=matrix_from_rpy(trajectory.rpy[epoch]),
            end_v=np.ascontiguousarray(trajectory.velocity[epoch]),
            end_rate=rate,
        )

    def analyse(self, truth: SensorModels, believed: SensorModels) -> Analysis:
        """True and predicted covariance of a filter; see `covariance_analysis`."""
        scenario, dt = self.scenario, self.scenario.trajectory.dt
        aiding = scenario.aiding.without(scenario.outages)
        ready = Filter.of(believed, aiding, dt, scenario.step, scenario.second_order)
        real = Filter.of(truth, aiding, dt, scenario.step, drift_known=True)
        events = aiding.events(dt, scenario.trajectory.n)
        initial = scenario.trajectory.state(0)
        table, joint = ready.states, _joint(ready.states, real.states)
        m, size = table.m, NAVIGATION + joint.m
        P = ready.covariance(initial, scenario.initial_sd)
        J = np.zeros((size, size))
        deviations = scenario.initial_sd.deviations
        J[:NAVIGATION, :NAVIGATION] = modified(np.diag(deviations**2), initial.velocity)
        J[NAVIGATION:, NAVIGATION:] = joint.covariance + np.outer(joint.mean, joint.mean)
        kept = self.outputs.epoch.size
        out_P, out_J = (
            np.empty((kept, NAVIGATION + m, NAVIGATION + m)),
            np.empty((kept, size, size)),
        )
        run_both(
            self.epoch, self.samples, dt, self.mid_matrix, self.mid_v, self.mid_lla,
            self.end_matrix, self.end_v, self.end_rate,
            P, table.table, ready.noise_states, J, joint.table,
            np.where(real.noise_states >= 0, real.noise_states + m, -1),
            events, ready.lever_arm, ready.second_order,
            self.outputs.epoch, self.outputs.before, out_P, out_J,
        )  # fmt: skip
        index = self.outputs.epoch
        velocity = scenario.trajectory.velocity[index]
        nine = slice(0, NAVIGATION)
        # The filter's error in a sensor is the true sum less the estimated one, and either way
        # round it has the same second moments.
        believed_sum, joint_sum = table.sums, joint.sums
        found = Analysis(
            time=self.outputs.time(dt),
            before=self.outputs.before == 1,
            predicted=unmodified(out_P[:, nine, nine], velocity),
            actual=unmodified(out_J[:, nine, nine], velocity),
            sensor_predicted=believed_sum @ out_P[:, NAVIGATION:, NAVIGATION:] @ believed_sum.T,
            sensor_actual=joint_sum @ out_J[:, NAVIGATION:, NAVIGATION:] @ joint_sum.T,
        )
        ends = [outage.end for outage in scenario.outages]
        return replace(found, notices=tuple(_too_large(found, ends)))


def covariance_analysis(
    scenario: Scenario, truth: SensorModels, believed: SensorModels
) -> Analysis:
    """True error covariance of a filter whose sensor models are not the truth.

    Parameters
    ----------
    scenario : Scenario
    truth, believed : SensorModels
        What the sensors do, and what the filter believes.

    Notes
    -----
    Exact for small errors: the filter is linearised along the true trajectory, and a notice reports
    where attitude errors are too large for that (code "outside-linearity"). Where a filter that
    expects 30 m is 120 m off, products of errors reach the vertical at the first fixes after the
    outage, and its error is up to 1.7 times that given here for half a minute. A known mean of the
    true errors that the filter does not know, such as a ramp, counts as error.
    """
    return Course.of(scenario).analyse(truth, believed)


def _too_large(found: Analysis, ends: Sequence[float]) -> Iterator[Notice]:
    """Ends of outages at which the true attitude error is beyond where predictions were checked."""
    for end in ends:
        tilt_north, tilt_east, heading = found.sd[found.index(end), 6:]
        tilt = float(max(tilt_north, tilt_east))
        if tilt > tuning.LINEAR_TILT or heading > tuning.LINEAR_HEADING:
            yield Notice(
                "outside-linearity", "warning", "",
                f"at {end:g} s the attitude is off by {np.degrees(tilt):.2g} deg in tilt and "
                f"{np.degrees(heading):.2g} deg in heading (1 sigma): products of errors count, "
                "and NEES and errors predicted there are too small",
                {"time": end, "tilt": tilt, "heading": float(heading)},
                "check them by runs, as gmwm navigate does",
            )  # fmt: skip


def _steps(asked: IntArray, n: int, stride: int) -> IntArray:
    """Epochs at which steps end: every one that is asked for, and none more than a stride apart."""
    epochs: list[IntArray] = [np.zeros(1, dtype=np.int64)]
    marks = np.union1d(np.append(asked, [0, n]), [])
    for start, stop in pairwise(marks):
        between = np.arange(start + stride, stop, stride)
        epochs.append(np.append(between, stop))
    return np.concatenate(epochs).astype(np.int64)


def _joint(believed: SensorStates, truth: SensorStates) -> SensorStates:
    """Estimated states, which nothing but the filter moves, and then the true ones."""

    def both(first: FloatArray, second: FloatArray) -> FloatArray:
        return np.concatenate([first, second], axis=-1)

    own, real = believed.table, truth.table
    still = np.zeros_like(own.noise)
    covariance = np.zeros((believed.m + truth.m,) * 2)
    covariance[believed.m :, believed.m :] = truth.covariance
    return SensorStates(
        names=(*believed.names, *truth.names),
        mean=np.append(believed.mean, truth.mean),
        covariance=covariance,
        table=real._replace(
            paired=own.paired or real.paired,
            axis=np.append(own.axis, real.axis),
            output=np.append(-own.output, real.output),
            partner=np.append(own.partner, real.partner + believed.m),
            phi=both(own.phi, real.phi),
            phi_off=both(own.phi_off, real.phi_off),
            gain=both(-own.gain, real.gain),
            noise=both(still, real.noise),
            noise_off=both(still, real.noise_off),
            cross=both(still, real.cross),
        ),
    )
