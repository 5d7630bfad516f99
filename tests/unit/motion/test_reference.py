"""Noise of gyros in motion against an attitude."""

from functools import cache

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

import gmwm

RATE, SECONDS = 100.0, 120.0
AXES = [f"gyro_{axis}" for axis in "xyz"]
N = 2e-4  # rad/s/sqrt(Hz)


@cache
def flight(seed, angle=4e-5, turn=(0.1, -0.2, 0.05)):
    """A recording, and a reference from 0.25 s on with white noise of its angle, rad."""
    rng = np.random.default_rng(seed)
    fine = np.arange(-1.0, SECONDS + 1.0, 1e-2)
    frequency, phase = rng.uniform(0.05, 2.0, (20, 3)), rng.uniform(0.0, 2.0 * np.pi, (20, 3))
    waves = np.cos(2.0 * np.pi * frequency * fine[:, None, None] + phase).sum(axis=1)
    rates = CubicSpline(fine, 0.1 * waves)
    start = 0.25 + 0.01 * np.arange(int(100 * (SECONDS - 0.5)))
    parts = [Rotation.from_rotvec(2e-3 * rates(start + 2e-3 * k + 1e-3)) for k in range(5)]
    attitude = [Rotation.identity()]
    for step in parts[0] * parts[1] * parts[2] * parts[3] * parts[4]:
        attitude.append(attitude[-1] * step)
    quaternions = Rotation.concatenate(attitude)
    seen = Rotation.from_rotvec(angle * rng.normal(size=(len(quaternions), 3)))
    quaternions = quaternions * seen * Rotation.from_rotvec(turn)
    times = 7.0 + 0.01 * np.arange(len(quaternions))
    time = np.arange(int(RATE * SECONDS)) / RATE
    values = rates(time) + 0.01 + N * np.sqrt(RATE) * rng.normal(size=(time.size, 3))
    arrays = dict(zip(AXES, values.T, strict=True))
    recording = gmwm.Recording.from_arrays(arrays, RATE, {"gyro": "rad/s"})
    return recording, (times, quaternions.as_quat())


def test_noise_of_gyros_is_told_from_that_of_the_reference():
    recording, attitude = flight(3)
    found = gmwm.motion(recording, reference=attitude)
    ratios = []
    for curve in found.curves:
        truth = N**2 / curve.tau
        seen = np.isfinite(curve.variance)
        # 3 Q^2/tau^2 of the reference is above N^2/tau up to 3 Q^2/N^2, 0.12 s.
        assert not np.any(seen[:3])
        assert np.all(seen[5:])
        ratios.append(curve.variance[4:8] / truth[4:8])
        inside = (curve.lower <= truth) & (truth <= curve.upper)
        assert np.mean(inside[seen]) >= 0.6
        assert np.all(curve.upper[:3] > truth[:3])
    assert np.mean(ratios) == pytest.approx(1.0, abs=0.1)
    with pytest.raises(gmwm.InputError, match=r"these flights show .* in motion"):
        found.numbers(0.05, 1.0)  # not measured that early
    assert found.numbers(1.0, 2.0)["gyro_x"].params["N"] == pytest.approx(N, rel=0.3)
    (noise,) = (each for each in found.notices if each.code == "motion-reference")
    assert noise.values["angle"] == pytest.approx(4e-2, rel=0.15)
    assert found.clocks[0].offset == pytest.approx(-0.25, abs=5e-4)
    assert "reference" in str(found)
    (row,) = (line.split() for line in str(found).splitlines() if line.startswith("information"))
    for text, tau in zip(row[2:], (0.04, 0.16, 0.64, 1.28, 2.56, 5.12), strict=True):
        own, other = N**2 / tau, 3.0 * (4e-5 / tau) ** 2
        assert float(text) == pytest.approx((own / (own + other)) ** 2, abs=0.06)


@pytest.mark.parametrize("step", [4, 10])
def test_a_slow_reference_has_the_rotations_of_its_intervals(step):
    """At 25 and 10 Hz, of a motion up to 2 Hz: interpolated rates would be far off."""
    recording, (times, quaternions) = flight(3)
    found = gmwm.motion(recording, reference=(times[::step], quaternions[::step]))
    ratios = [
        (curve.variance * curve.tau / N**2)[(curve.tau > 0.2) & (curve.tau < 2.0)]
        for curve in found.curves
    ]
    assert np.mean(ratios) == pytest.approx(1.0, abs=0.1)
    assert found.clocks[0].offset == pytest.approx(-0.25, abs=5e-4)


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda t, q: (t, q[:, [3, 0, 1, 2]]), "gyro of reference and imu differ by more than"),
        (lambda t, q: (t, q * [-1, -1, -1, 1]), "gyro of reference and imu differ by more than"),
        (lambda t, q: (t, np.where(t[:, None] == t[9], np.nan, q)), "do not have a length of 1"),
        (lambda t, q: (t, 2.0 * q), "do not have a length of 1"),
        (lambda t, q: (t[:-1], q), "do not have a length of 1"),
        (
            lambda t, q: (np.where(t > t[9], t + 4.0, t), q),
            "has gaps, 4.01 s in all: give a part without",
        ),
    ],
)
def test_a_reference_that_is_no_attitude_is_rejected(spoil, message):
    recording, attitude = flight(3)
    with pytest.raises(gmwm.InputError, match=message):
        gmwm.motion(recording, reference=spoil(*attitude))


def test_a_reference_that_dominates_is_rejected():
    recording, attitude = flight(4, angle=3e-3)
    message = r"noise of the reference's angle, .* dominates .*: .* at 0.02 s, 0 % at 0.04 s, "
    with pytest.raises(gmwm.InputError, match=message):
        gmwm.motion(recording, reference=attitude)


HEADS = {
    "euroc": "#timestamp [ns],p_RS_R_x [m],q_RS_w [],q_RS_x [],q_RS_y [],q_RS_z []",
    "plain": "time [s],qx,qy,qz,qw",
    "tum": "",
}


@pytest.mark.parametrize("kind", HEADS)
def test_files_of_attitudes_are_read(run, tmp_path, kind):
    recording, (times, q) = flight(3)
    expected = gmwm.motion(recording, reference=(times, q))
    imu = np.column_stack([np.arange(recording.n) / RATE, *(recording[a].values for a in AXES)])
    head = "time [s]," + ",".join(f"{name} [rad/s]" for name in AXES)
    np.savetxt("imu.csv", imu, "%.9g", ",", header=head, comments="")
    none = np.zeros((len(q), 1))
    columns, form = {
        "euroc": ([1e9 * times + 1.4e18, none, q[:, 3:], q[:, :3]], "%.12g"),
        "plain": ([times, q], "%.9g"),
        "tum": ([times, none, none, none, q], "%.9g"),
    }[kind]
    rows = np.column_stack(columns)
    if kind == "euroc":
        form = ["%d", *["%.12g"] * 5]
    np.savetxt(
        "ref.csv", rows, form, " " if kind == "tum" else ",", header=HEADS[kind], comments=""
    )
    code, _, error = run("motion", "imu.csv", "--reference", "ref.csv", "-o", "found.json")
    assert (code, error) == (0, "")
    found = gmwm.load("found.json")
    for own, other in zip(found.curves, expected.curves, strict=True):
        assert own.variance[6:] == pytest.approx(other.variance[6:], rel=0.02)
