"""Covariance analysis: the true errors of a filter with a wrong model, without Monte Carlo."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any, ClassVar, Self

import numpy as np
from scipy.linalg import block_diag, eigh

from gmwm._core import checks
from gmwm._core.typing import BoolArray, FloatArray, IntArray
from gmwm.errors import InputError
from gmwm.ins import tuning
from gmwm.ins.filter.aiding import Aiding, Outage, gnss, odometry, poses, wheels
from gmwm.ins.filter.covariance_kernels import NAVIGATION
from gmwm.ins.filter.filter import Filter, Outputs, unmodified
from gmwm.ins.filter.measurements import IS_RELATIVE, KINDS, new_keyframe, observe_since
from gmwm.ins.filter.records import Events, Keyframe, Kinematics
from gmwm.ins.filter.states import SensorStates
from gmwm.ins.geometry import matrix_from_rpy
from gmwm.ins.increments import Imu, emulate
from gmwm.ins.joint_kernels import JointFilter, KeptCovariances, Track, run_jointly
from gmwm.ins.sensors import SensorModels
from gmwm.ins.simulation.consistency import place_of
from gmwm.ins.simulation.trials import Scenario
from gmwm.ins.trajectory.missions import car_drive, fixed_wing_loiter
from gmwm.ins.trajectory.trajectory import Trajectory
from gmwm.issues import Notice, notice


@dataclass(frozen=True, eq=False)
class CovarianceErrors:
    """What a filter predicts of its errors, and what is true of them, at T times.

    time: (T,), s.
    predicted, actual: (T, n, n), covariance of n errors: the filter's own, and the true one.
    """

    USUAL_PART: ClassVar[slice] = slice(None)

    time: FloatArray
    predicted: FloatArray
    actual: FloatArray

    def nees(self, part: slice | None = None) -> FloatArray:
        """Expected normalised error squared per degree of freedom, (T,); 1 if consistent.

        Errors that the filter predicts to be exactly zero are left out.
        """
        part = self.USUAL_PART if part is None else part
        predicted, actual = self.predicted[:, part, part], self.actual[:, part, part]
        size = np.sqrt(np.maximum(np.diagonal(predicted, axis1=1, axis2=2), 0.0))
        scale = np.where(size > 0.0, size, 1.0)
        outer = scale[:, :, None] * scale[:, None, :]
        ratio = np.linalg.pinv(predicted / outer, hermitian=True) @ (actual / outer)
        return np.asarray(np.trace(ratio, axis1=1, axis2=2) / predicted.shape[1])

    def worst(self) -> FloatArray:
        """NEES of the worst direction: largest eigenvalue of P_predicted^-1 P_actual, (T,)."""
        pairs = zip(self.actual, self.predicted, strict=True)
        return np.array([eigh(a, p, eigvals_only=True)[-1] for a, p in pairs])

    def score(self, part: slice | None = None) -> FloatArray:
        """Expected negative logarithm of the predicted density at the truth, (T,)."""
        part = self.USUAL_PART if part is None else part
        predicted = self.predicted[:, part, part]
        size = predicted.shape[1]
        log_det = np.linalg.slogdet(predicted)[1]
        return np.asarray(0.5 * (size * self.nees(part) + log_det + size * np.log(2.0 * np.pi)))


@dataclass(frozen=True, eq=False)
class Analysis(CovarianceErrors):
    """What a navigation filter predicts, and what is true of it, at K epochs.

    Attributes
    ----------
    time : (K,) ndarray
        s.
    predicted, actual : (K, 9, 9) ndarray
        Covariance of the errors of position (m), velocity (m/s) and attitude (rad): the filter's
        own, and the true one.
    before : (K,) ndarray of bool
        Whether the measurements of the epoch are not in yet.
    sensor_predicted, sensor_actual : (K, 6, 6) ndarray
        Of the estimated errors of the sensors, rad/s and m/s^2.
    notices : tuple of Notice
        Outages that end with errors larger than can be predicted without runs.
    since : CovarianceErrors or None
        With relative poses: of the way since the last keyframe, in its body axes, m, and of the
        turn, rad.
    """

    USUAL_PART = slice(0, 3)  # the position

    before: BoolArray
    sensor_predicted: FloatArray
    sensor_actual: FloatArray
    notices: tuple[Notice, ...] = ()
    since: CovarianceErrors | None = None

    @property
    def sd(self) -> FloatArray:
        """True standard deviations of the nine navigation errors, (K, 9)."""
        return np.sqrt(np.diagonal(self.actual, axis1=1, axis2=2))

    @property
    def predicted_sd(self) -> FloatArray:
        """Predicted standard deviations, (K, 9)."""
        return np.sqrt(np.diagonal(self.predicted, axis1=1, axis2=2))

    def index(self, time: float, *, before: bool = True) -> int:
        """Place of an epoch; InputError if it was not kept."""
        return place_of(time, self.time, self.before == before)


@dataclass(frozen=True, eq=False)
class Course:
    """A scenario cut into steps of the covariance: what does not depend on the models."""

    scenario: Scenario
    outputs: Outputs
    events: Events
    track: Track

    @classmethod
    def of(cls, scenario: Scenario, imu: Imu | None = None) -> Self:
        """Cut a scenario; ``imu`` is that of its trajectory, error-free."""
        trajectory = scenario.trajectory
        imu = emulate(trajectory) if imu is None else imu
        stride = max(round(scenario.step / trajectory.dt), 1)
        outputs = scenario.outputs()
        events = scenario.aiding.without(scenario.outages).events(trajectory.dt, trajectory.n)
        # Every epoch that is asked for, and none more than a stride apart.
        marks = np.union1d(events.epoch, np.append(outputs.epoch, [0, trajectory.n]))
        between = [np.append(np.arange(a, b, stride), b)[1:] for a, b in pairwise(marks)]
        epoch: IntArray = np.concatenate([np.zeros(1, dtype=np.int64), *between])
        samples = np.diff(epoch, prepend=0)
        # The middle of an odd number of samples lies between two epochs.
        early = epoch - samples + samples // 2
        late = early + samples % 2
        motion = (matrix_from_rpy(trajectory.rpy), trajectory.velocity, trajectory.lla)
        middle = (np.ascontiguousarray(0.5 * (each[early] + each[late])) for each in motion)
        end = (np.ascontiguousarray(each[epoch]) for each in motion)
        rate = imu.rotation[np.maximum(epoch - 1, 0)] / trajectory.dt
        track = Track(epoch, samples, trajectory.dt, Kinematics(*middle), Kinematics(*end), rate)
        return cls(scenario, outputs, events, track)

    def analyse(self, truth: SensorModels, believed: SensorModels) -> Analysis:
        """True and predicted covariance of a filter; see `covariance_analysis`."""
        scenario, dt, kept = self.scenario, self.track.dt, self.outputs
        ready = Filter.of(believed, scenario.aiding, dt, scenario.step, scenario.second_order)
        real = Filter.of(truth, scenario.aiding, dt, scenario.step, drift_known=True)
        initial, table = scenario.trajectory.state(0), ready.states
        joint, n, m = _joint(table, real.states), NAVIGATION, NAVIGATION + table.m
        P = ready.covariance(initial, scenario.initial_sd)
        J = block_diag(P[:n, :n], joint.covariance + np.outer(joint.mean, joint.mean))
        if ready.keyframe >= 0:
            new_keyframe(J, *ready.at_keyframe(initial), -1.0)
        out = KeptCovariances(
            kept.epoch,
            kept.before,
            np.empty((kept.epoch.size, *P.shape)),
            np.empty((kept.epoch.size, *J.shape)),
        )
        own_noise, true_noise = (
            np.where(each.settings.noise_states >= 0, each.settings.noise_states + first, -1)
            for each, first in ((ready, n), (real, m))
        )
        keyframe = ready.at_keyframe(initial)[1]
        about = JointFilter(ready.settings, joint.table, own_noise, true_noise, keyframe)
        run_jointly(self.track, self.events, about, P, J, out)
        velocity = scenario.trajectory.velocity[kept.epoch]
        # The filter's error in a sensor is the true sum less the estimated one, and either way
        # round it has the same second moments.
        found = Analysis(
            time=kept.time(dt),
            before=kept.before == 1,
            predicted=unmodified(out.P[:, :n, :n], velocity),
            actual=unmodified(out.J[:, :n, :n], velocity),
            sensor_predicted=table.sums @ out.P[:, n:, n:] @ table.sums.T,
            sensor_actual=joint.sums @ out.J[:, n:, n:] @ joint.sums.T,
        )
        since = None
        if ready.keyframe >= 0:
            rows = self._rows_since(ready.keyframe, m)
            own = rows * np.where(np.arange(m) < n, 1.0, -1.0)  # estimates are errors turned round
            predicted = rows @ out.P @ np.swapaxes(rows, 1, 2)
            actual = own @ out.J[:, :m, :m] @ np.swapaxes(own, 1, 2)
            since = CovarianceErrors(found.time, predicted, actual)
        notices = []
        for end in (outage.end for outage in scenario.outages):
            *tilts, heading = map(float, found.sd[found.index(end), 6:])
            tilt = max(tilts)
            if tilt > tuning.LINEAR_TILT or heading > tuning.LINEAR_HEADING:
                values = {"time": end, "tilt": tilt, "heading": heading}
                t, h = math.degrees(tilt), math.degrees(heading)
                notices.append(notice("outside-linearity", "", values, tilt_deg=t, heading_deg=h))
        return replace(found, notices=tuple(notices), since=since)

    def _rows_since(self, first: int, size: int) -> FloatArray:
        """Rows of the way and the turn since the last keyframe at each kept epoch, (K, 6, size)."""
        kept, truth = self.outputs, self.scenario.trajectory
        taken = np.append(0, self.events.epoch[IS_RELATIVE[self.events.kind]])
        rows = np.zeros((kept.epoch.size, 6, size))
        for k, (epoch, is_before) in enumerate(zip(kept.epoch, kept.before, strict=True)):
            last = int(np.max(taken[taken < epoch + 1 - is_before], initial=0))
            here, there = (
                Kinematics(matrix_from_rpy(truth.rpy[i]), truth.velocity[i], truth.lla[i])
                for i in (epoch, last)
            )
            for i in range(6):
                kind = KINDS["displacement" if i < 3 else "rotation"]
                about = (np.zeros(3), here, Keyframe(there, first))
                observe_since(kind, i % 3, *about, rows[k, i])
        return rows


def covariance_analysis(
    scenario: Scenario, truth: SensorModels, believed: SensorModels
) -> Analysis:
    """True error covariance of a filter that has the models ``believed`` of sensors ``truth``.

    Notes
    -----
    Exact for small errors: the filter is linearised along the true trajectory, and a notice reports
    where attitude errors are too large for that (code "outside-linearity"). Where a filter that
    expects 30 m is 120 m off, products of errors reach the vertical at the first fixes after the
    outage, and its error is up to 1.7 times that given here for half a minute. A known mean of the
    true errors that the filter does not know, such as a ramp, counts as error.
    """
    return Course.of(scenario).analyse(truth, believed)


def _joint(believed: SensorStates, truth: SensorStates) -> SensorStates:
    """Estimated states, which nothing but the filter moves, and then the true ones."""
    own, real = believed.table, truth.table
    mine = dict.fromkeys(("noise", "noise_off", "cross"), np.zeros_like(own.noise))
    mine |= {"phi": own.phi, "phi_off": own.phi_off, "gain": -own.gain}
    both: dict[str, Any] = {
        name: np.concatenate([array, getattr(real, name)], axis=-1) for name, array in mine.items()
    }
    return SensorStates(
        names=(*believed.names, *truth.names),
        mean=np.append(believed.mean, truth.mean),
        covariance=block_diag(np.zeros((believed.m, believed.m)), truth.covariance),
        table=real._replace(
            paired=own.paired or real.paired,
            axis=np.append(own.axis, real.axis),
            output=np.append(-own.output, real.output),
            partner=np.append(own.partner, real.partner + believed.m),
            **both,
        ),
    )


# -- the loiter that numbers are judged on ---------------------------------------------------------

_WHEELS_EVERY = 0.1  # s, or the nearest multiple of the sampling interval


def _wheels(truth: Trajectory, _: float) -> Aiding:
    """With keyframes that measure nothing, from which the way in an outage counts."""
    interval = max(round(_WHEELS_EVERY / truth.dt), 1) * truth.dt
    return wheels(truth, interval) + odometry(truth, interval).unused()


AIDINGS: dict[str, Callable[[Trajectory, float], Aiding]] = {
    "gnss": lambda truth, _: gnss(truth),
    "pose": poses,
    "odometry": odometry,
    "wheels": _wheels,
}
"""What aids the filter of `loiter_with_outages`, given the trajectory and an interval, s."""


def loiter_with_outages(
    lengths: Sequence[float],
    dt: float = 0.01,
    trajectory: Trajectory | None = None,
    aiding: str = "gnss",
    keyframe: float = 1.0,
) -> Scenario:
    """A loiter with one GNSS position a second of 1 m (vertical 1.5 m), and outages.

    Raises InputError if a length is not positive or not a multiple of ``dt``, or the trajectory
    is too short.

    Parameters
    ----------
    lengths : sequence of float
        Of the outages, s, with two minutes before each.
    dt : float, optional
        Sampling interval of the IMU of the loiter, s.
    trajectory : Trajectory, optional
        Another motion than a loiter of a fixed-wing aircraft, or a car's drive with wheels.
    aiding : {"gnss", "pose", "odometry", "wheels"}, optional
        Absolute poses (5 cm, 0.2 deg) or relative ones (1 cm, 1 mrad) at keyframes, or wheel
        odometry (5 cm/s; 10 cm/s aside and down) ten times a second, in place of GNSS.
    keyframe : float, optional
        Interval of the keyframes, s.
    """
    aids = AIDINGS[checks.choice("aiding", aiding, tuple(AIDINGS))]
    outages, start = list[Outage](), tuning.SETTLING
    for length in lengths:
        outages.append(Outage(start, checks.positive("outage length", length)))
        # Ends at a fix: those of one second.
        start = float(np.ceil(start + length + tuning.SETTLING))
    end = outages[-1].end if outages else 0.0
    if trajectory is None:
        make = car_drive if aiding == "wheels" else fixed_wing_loiter
        trajectory = make(duration=max(start, 2.0 * tuning.SETTLING), dt=dt)
    elif trajectory.duration < end:
        raise InputError(
            f"trajectory: it has {trajectory.duration:g} s, but these outages, with two minutes "
            f"between them, need {end:g} s: give a longer one, or fewer outages"
        )
    aided = aids(trajectory, keyframe)
    return Scenario(trajectory, aided, tuple(outages), interval=tuning.SETTLING)
