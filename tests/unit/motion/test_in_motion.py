"""Noise in motion: errors of known variance on IMUs that share a motion."""

from itertools import product

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

import gmwm
from marks import slow

RATE, SECONDS = 50.0, 90.0
DT = 1.0 / RATE
AXES = [f"{sensor}_{axis}" for sensor in ("gyro", "accel") for axis in "xyz"]
SIZE = np.array([2e-3] * 3 + [2e-2] * 3)  # white noise of a sample, rad/s and m/s^2


def motion_of(rng, lowest=0.05, highest=3.0):
    """Rates and forces of a body as splines: 40 lines up to 3 Hz each, and gravity."""
    time = np.arange(-1.0, SECONDS + 1.0, 0.02)
    frequency = rng.uniform(lowest, highest, (40, 6))
    phase = rng.uniform(0.0, 2.0 * np.pi, (40, 6))
    waves = np.cos(2.0 * np.pi * frequency * time[:, None, None] + phase).sum(axis=1)
    size = np.array([0.06] * 3 + [0.5] * 3)
    return CubicSpline(time, waves * size + np.array([0.0] * 5 + [9.8]))


def imu(body, errors, *, offset=0.0, drift=0.0, turn=(0.0, 0.0, 0.0), arm=(0.0, 0.0, 0.0)):
    """A recording of an IMU at ``-arm`` from the first one, with its own clock and axes."""
    time = (np.arange(len(errors)) * DT - offset) / (1.0 + drift)
    signal, slope = body(time), body(time, 1)
    rates, lever = signal[:, :3], -np.array(arm)
    forces = signal[:, 3:] + np.cross(slope[:, :3], lever)
    forces += np.cross(rates, np.cross(rates, lever))
    turned = Rotation.from_rotvec(turn).as_matrix()
    values = np.hstack([rates @ turned, forces @ turned]) + errors
    return recording(values)


def recording(values, rate=RATE):
    units = {"gyro": "rad/s", "accel": "m/s^2"}
    return gmwm.Recording.from_arrays(dict(zip(AXES, values.T, strict=True)), rate, units)


def white(rng, count):
    return SIZE * rng.normal(size=(count, int(SECONDS * RATE), 6))


POSES = (
    {},
    {"offset": 0.01, "drift": 3e-5, "turn": (0.2, -0.25, 0.1), "arm": (0.1, 0.0, 0.02)},
    {"offset": -0.002, "drift": -2e-5, "turn": (0.0, 0.0, 0.3), "arm": (0.0, -0.1, 0.0)},
    {"offset": 0.31, "turn": (0.1, 0.1, 0.1), "arm": (0.05, 0.05, -0.05)},
)


def imus(rng, count, errors=None):
    body = motion_of(rng)
    errors = white(rng, count) if errors is None else errors
    return [imu(body, own, **pose) for own, pose in zip(errors, POSES, strict=False)]


@pytest.mark.parametrize("count", [3, 4])
def test_variances_are_those_of_the_errors(count):
    rng = np.random.default_rng(count)
    scale = 1.0 + 0.5 * np.arange(count)[:, None, None]
    found = gmwm.motion(imus(rng, count, scale * white(rng, count)))
    size = {name: own for name, own in zip(AXES, SIZE, strict=True)}
    ratios, inside = [], []
    for curve in found.curves:
        own = size[curve.channel] * (1.0 + 0.5 * found.imus.index(curve.imu))
        truth = own**2 * DT / curve.tau
        ratios.append((curve.variance / truth)[:8])  # up to 2.6 s, 1/35 of the record
        inside.append(((curve.lower <= truth) & (truth <= curve.upper))[:8])
    mean, error = np.mean(ratios, axis=0), np.std(ratios, axis=0) / np.sqrt(len(ratios))
    assert np.all(np.abs(mean - 1.0) < 4.0 * error)
    assert 0.85 < np.mean(inside) < 0.99
    assert np.all(np.abs(mean[:3] - 1.0) < 0.03)


def test_clocks_and_mountings_are_found():
    found = gmwm.motion(imus(np.random.default_rng(5), 4))
    for clock, pose in zip(found.clocks, POSES[1:], strict=True):
        assert abs(clock.offset - pose["offset"]) < 4.0 * clock.offset_error < 2e-3
        assert abs(clock.drift - pose.get("drift", 0.0)) < 4.0 * clock.drift_error < 4e-5
    to_first = [m for m in found.mountings if m.target == "imu 1" and m.sensor == "accel"]
    for mounting, pose in zip(to_first, POSES[1:], strict=True):
        assert np.allclose(mounting.rotation, pose["turn"], atol=2e-3)
        error = mounting.lever_arm_error
        assert np.all(np.abs(mounting.lever_arm - pose["arm"]) < 4.0 * error)
        assert np.all(error < 0.02)
        assert np.all(np.abs(mounting.correction) < 5.0 * mounting.correction_error)


def test_what_fits_take_from_short_flights_is_given_back():
    """Motion of half a hertz for 15 s: a dozen parameters take an eighth of the noise."""
    rng = np.random.default_rng(19)
    flights = []
    for _ in range(16):
        body = motion_of(rng, 0.3, 0.7)
        flights.append([imu(body, own[:750]) for own in white(rng, 3)])
    curves = gmwm.motion(flights).curves
    size = dict(zip(AXES, SIZE, strict=True))
    ratios = [(c.variance * c.tau)[5] / (size[c.channel] ** 2 * DT) for c in curves]
    error = np.std(ratios) / np.sqrt(len(ratios))
    assert abs(np.mean(ratios) - 1.0) < 3.0 * error < 0.08


def test_lags_of_motion_do_not_amplify_vibration():
    """Accelerometers of one IMU are 8 ms late: its vibration is not 8 ms times its slopes."""
    rng = np.random.default_rng(18)
    body, errors = motion_of(rng), white(rng, 3)
    errors[:, 1:, 3:] = 10.0 * np.diff(errors[:, :, 3:], axis=1)
    recordings = [imu(body, own) for own in errors]
    time = np.arange(errors.shape[1]) * DT
    late = np.hstack([body(time)[:, :3], body(time - 0.008)[:, 3:]]) + errors[1]
    recordings[1] = recording(late)
    found = gmwm.motion(recordings)
    (lag,) = (
        m.lag for m in found.mountings if (m.imu, m.target, m.sensor) == ("imu 2", "imu 1", "accel")
    )
    assert lag == pytest.approx(0.008, abs=0.002)
    for k, axis in enumerate(AXES[3:], start=3):
        haar = np.diff(errors[:2, :, k], axis=1)
        both = 0.5 * np.mean(haar**2, axis=1).sum()
        assert found.curve("imu 1", axis).differences[0, 0] == pytest.approx(both, rel=0.05)


def test_two_imus_give_the_sum_and_say_so():
    rng = np.random.default_rng(6)
    at_rest = recording(white(rng, 1)[0])
    static = {name: gmwm.fit("N", gmwm.wavelet_variance(at_rest[name])) for name in AXES}
    found = gmwm.motion(imus(rng, 2), static=static)
    curve = found.curve("imu 1", "gyro_y")
    assert curve.factor[4] == pytest.approx(1.0, rel=0.1)  # the sum of both at rest, too
    both = 2.0 * SIZE[1] ** 2  # half a variance of differences, of two IMUs
    # Interpolation between samples takes some of the mapped IMU's noise.
    assert 0.75 * both < curve.variance[0] < 1.03 * both
    assert curve.variance[4] == pytest.approx(both / 16.0, rel=0.15)
    assert [n.code for n in found.notices] == ["motion-two-imus"]
    assert "both IMUs together" in str(found)


def test_rest_gives_the_static_allan_variance():
    rng = np.random.default_rng(7)
    at_rest = [recording(own + np.array([0.0] * 5 + [9.8])) for own in white(rng, 3)]
    static = {name: gmwm.fit("N", gmwm.wavelet_variance(at_rest[0][name])) for name in AXES}
    found = gmwm.motion(at_rest, static=static)
    curve = found.curve("imu 1", "accel_z")
    assert curve.factor[1:] == pytest.approx(np.ones(len(curve.tau) - 1), rel=0.02)
    codes = {"motion-at-rest", "motion-common", "motion-neighbours"}
    assert {n.code for n in found.notices} == codes
    assert found.clocks == () == found.mountings


def test_noise_that_follows_the_vibration():
    """White noise whose size varies by three: the exponent is one, classes have their own sizes."""
    rng, rate, n = np.random.default_rng(17), 100.0, 12_000
    level = np.exp(0.6 * np.sin(np.arange(n) * 2.0 * np.pi / (40.0 * rate)))
    noise = SIZE * level[:, None] * rng.normal(size=(3, n, 6))
    at_rest = [recording(own + np.array([0.0] * 5 + [9.8]), rate) for own in noise]
    found = gmwm.motion(at_rest)
    for curve in found.curves:
        # At means over a second of a level that changes in ten.
        error = curve.exponent_error[:5]
        assert np.all(error < 0.25)
        assert np.all(np.abs(curve.exponent[:5] - 1.0) < 1.7 * error + 0.05)
    limits = np.quantile(level, [1 / 3, 2 / 3])
    for k, each in enumerate(found.classes):
        own = level[np.searchsorted(limits, level) == k]
        assert each.share == pytest.approx(1 / 3, abs=0.01)
        curve = found.at(each.name).curve("imu 1", "gyro_y")
        truth = SIZE[1] ** 2 * np.mean(own**2)
        assert curve.variance[0] == pytest.approx(truth, rel=0.05)
        assert curve.lower[0] < curve.variance[0] < curve.upper[0]
    given = gmwm.motion(at_rest, limits=(0.018, 0.04)).classes
    assert [each.name for each in given] == ["low", "middle", "high"]
    assert given[0].share < 1 / 3 < given[0].share + given[1].share
    with pytest.raises(gmwm.InputError, match="give two rising levels"):
        gmwm.motion(at_rest, limits=(2.0, 1.0))
    with pytest.raises(gmwm.MissingNameError, match="no class 'rest': there are low, middle, high"):
        found.at("rest")


def test_neighbours_that_share_an_error_are_reported():
    rng = np.random.default_rng(8)
    errors = white(rng, 4)
    errors[:2] += 2.0 * SIZE * rng.normal(size=errors[0].shape)
    body = motion_of(rng)
    found = gmwm.motion([imu(body, own) for own in errors])
    assert "motion-pairs-differ" in {n.code for n in found.notices}
    curve = found.curve("imu 1", "gyro_x")
    # Pairs (2, 3) and (2, 4) are without what the first two share; (3, 4) is not.
    assert curve.pairs[:, 0] / SIZE[0] ** 2 == pytest.approx([1.0, 1.0, 5.0], rel=0.2)


def test_what_all_have_in_common_is_not_seen_and_that_is_said():
    rng = np.random.default_rng(9)
    errors = white(rng, 3)
    common = 3.0 * SIZE * rng.normal(size=errors[0].shape)
    body = motion_of(rng)
    found = gmwm.motion([imu(body, own + common) for own in errors])
    variance = found.curve("imu 2", "gyro_z").variance
    assert variance[0] == pytest.approx(SIZE[2] ** 2, rel=0.2)
    assert [n.values for n in found.notices if n.code == "motion-common"] == [{"imus": 3}]


@pytest.mark.parametrize("late", [(0.0, 0.0, 0.0), (0.0, 1 / 3, 2 / 3), slow((0.0, 0.5, 0.5))])
def test_aliased_vibration_is_seen_as_far_as_imus_sample_apart(late):
    """A line at 38 Hz is seen at 12 Hz, a turn later per sampling interval.

    With phases p of the target and q, r of the others, the mean of products of differences is
    that of the line times 1 - cos(p - q) - cos(p - r) + cos(q - r).
    """
    rng = np.random.default_rng(20)
    body, size = motion_of(rng), 5.0 * SIZE

    def shaken(time, order=0):
        line = size * np.sin(2.0 * np.pi * 38.0 * time)[:, None]
        return body(time, order) + (line if order == 0 else 0.0)

    errors = white(rng, 3)
    found = gmwm.motion([imu(shaken, e, offset=d * DT) for e, d in zip(errors, late, strict=True)])
    together = [n.text for n in found.notices if n.code == "motion-together"]
    pairs = {"imu 1 and imu 2": late[0] == late[1], "imu 2 and imu 3": late[1] == late[2]}
    for pair, is_one in pairs.items():
        assert (pair in "".join(together)) == is_one
    seen = np.sin(2.0 * np.pi * 12.0 * DT * np.arange(errors.shape[1]))
    for k, channel in product(range(3), AXES):
        p, q, r = 2.0 * np.pi * np.roll(late, -k)
        share = 1.0 - np.cos(p - q) - np.cos(p - r) + np.cos(q - r)
        white_too = SIZE[AXES.index(channel)] ** 2
        line = 25.0 * white_too * 0.5 * np.mean(np.diff(seen) ** 2)
        variance = found.curve(f"imu {k + 1}", channel).variance[0]
        assert variance == pytest.approx(share * line + white_too, rel=0.1, abs=0.03 * line)
    rows = [row for row in str(found).splitlines() if row.startswith("imu ")]
    negative = any(np.any(curve.variance[:3] <= 0.0) for curve in found.curves)
    assert any(" - " in f"{row} " for row in rows) or not negative


def test_glitches_and_lost_samples_cost_an_instant():
    rng = np.random.default_rng(13)
    body, errors = motion_of(rng), white(rng, 3)
    whole = gmwm.motion([imu(body, own) for own in errors])
    errors[0, 2000:2005] += 200.0 * SIZE
    errors[1, 3000] = np.nan
    found = gmwm.motion([imu(body, own) for own in errors])
    assert {"motion-events", "motion-filled"} <= {n.code for n in found.notices}
    for damaged, curve in zip(found.curves, whole.curves, strict=True):
        assert damaged.variance[:6] == pytest.approx(curve.variance[:6], rel=0.07)


def test_a_clock_that_wanders_is_rejected():
    rng = np.random.default_rng(10)
    body, errors = motion_of(rng), white(rng, 3)
    time = np.arange(errors.shape[1]) * DT
    late = 0.01 * np.sin(2.0 * np.pi * time / 40.0)
    wandering = recording(body(time - late) + errors[2])
    with pytest.raises(gmwm.InputError, match=r"clock of imu 3 wanders .* by \d"):
        gmwm.motion([imu(body, errors[0]), imu(body, errors[1]), wandering])


def test_imus_on_different_bodies_are_rejected():
    rng = np.random.default_rng(11)
    others = [imu(motion_of(rng), own) for own in white(rng, 3)]
    with pytest.raises(gmwm.InputError, match="one rigid body"):
        gmwm.motion(others)


@pytest.mark.parametrize("sensor", ["gyro", "accel"])
@pytest.mark.parametrize("wrong", [-1.0, 1 / 9.81, 57.3])
def test_other_units_and_signs_are_rejected(sensor, wrong):
    """All IMUs have gravity, and the same rates but for their turn."""
    recordings = imus(np.random.default_rng(21), 3)
    values = np.stack([recordings[1][name].values for name in AXES], axis=1)
    values[:, [name.startswith(sensor) for name in AXES]] *= wrong
    recordings[1] = recording(values)
    with pytest.raises(gmwm.InputError, match=f"{sensor} of imu 2 and imu 1 differ by more than"):
        gmwm.motion(recordings)


def changed(kind, values):
    """Samples of an IMU that is mounted, wired or read wrongly."""
    if kind == "swapped":
        return values[:, [0, 1, 2, 4, 3, 5]]
    if kind == "mirrored":
        return values * [1, 1, 1, -1, 1, 1]
    if kind == "stuck":
        return np.where(np.arange(len(values))[:, None] > 2000, values[2000], values)
    if kind == "cut off":
        return np.minimum(values, np.quantile(values, 0.95, axis=0))
    return np.round(values, 5)


@pytest.mark.parametrize(
    ("kind", "message"),
    [
        ("swapped", "accel of imu 2 and imu 1 differ by more than"),
        ("mirrored", "accel of imu 2 and imu 1 differ by more than"),
        ("stuck", "imu 2: gyro_x stays at one value for .* s"),
        ("cut off", "imu 2: gyro_x is cut off at"),
        ("copied", "imu 2 and imu 3 have the same errors"),
    ],
)
def test_channels_that_gravity_does_not_show_to_be_wrong_are_rejected(kind, message):
    """Level, all horizontal axes have a mean force of zero."""
    recordings = imus(np.random.default_rng(22), 3)
    of = 2 if kind == "copied" else 1
    values = np.stack([recordings[of][name].values for name in AXES], axis=1)
    recordings[1] = recording(changed(kind, values))
    with pytest.raises(gmwm.InputError, match=message):
        gmwm.motion(recordings)


def test_spikes_of_single_samples_are_left_out():
    rng = np.random.default_rng(26)
    recordings = imus(rng, 3)
    values = np.stack([recordings[1][name].values for name in AXES], axis=1)
    values[rng.integers(10, len(values) - 10, 20)] += 100.0 * SIZE
    recordings[1] = recording(values)
    found = gmwm.motion(recordings)
    assert [n.values for n in found.notices if n.code == "motion-filled"]
    variance = found.curve("imu 2", "gyro_x").variance[0]
    assert variance == pytest.approx(SIZE[0] ** 2, rel=0.1)


def test_turns_about_one_axis_leave_the_rotation_about_it_open():
    rng = np.random.default_rng(23)
    body, errors = motion_of(rng), white(rng, 3)

    def flat(time, order=0):
        return body(time, order) * [1e-3, 1e-3, 1.0, 1.0, 1.0, 1.0]

    with pytest.raises(gmwm.InputError, match="turn about one axis only"):
        gmwm.motion([imu(flat, own, **pose) for own, pose in zip(errors, POSES, strict=False)])


def test_imus_may_start_more_than_half_a_recording_apart():
    rng = np.random.default_rng(24)
    body, errors = motion_of(rng), white(rng, 3)[:, :2000]
    found = gmwm.motion([imu(body, own, offset=-15.0 * k) for k, own in enumerate(errors)])
    assert found.clocks[1].offset == pytest.approx(-30.0, abs=2e-3)


def test_a_walk_that_dominates_has_numbers_with_an_n_above_zero():
    rng = np.random.default_rng(25)
    walks = np.cumsum(0.05 * white(rng, 3), axis=1)
    found = gmwm.motion(imus(rng, 3, walks + 0.01 * white(rng, 3)))
    assert "largest axis" in str(found)
    assert all(model.params["N"] > 0.0 for model in found.numbers().values())


@pytest.mark.parametrize(
    ("sources", "message"),
    [
        ("imu.csv", "list of recordings"),
        ([], "two IMUs"),
        ([recording(np.ones((200, 6)))], "two IMUs"),
        ([recording(np.ones((200, 6))), "imu.csv"], "read it first"),
        ([recording(np.ones((200, 6))), recording(np.zeros((200, 6)), 60.0)], "50 to 60 Hz"),
        ([recording(np.ones((200, 6)))] * 2, "flight 1: imu 2 is a copy: give each IMU once"),
        ([[recording(np.ones((200, 6)))] * 2, [recording(np.ones((200, 6)))] * 3], "same order"),
    ],
)
def test_what_cannot_be_used_is_rejected(sources, message):
    with pytest.raises(gmwm.InputError, match=message):
        gmwm.motion(sources)


def test_several_flights_are_joined_and_the_result_is_stored(tmp_path):
    rng = np.random.default_rng(12)
    flights = [
        {f"unit {k}": each.part(0.0, 20.0 + 5.0 * f) for k, each in enumerate(imus(rng, 3))}
        for f in range(2)
    ]
    found = gmwm.motion(flights)
    loaded = gmwm.load(found.save(tmp_path / "motion.json"))
    assert str(loaded) == str(found)
    assert loaded.imus == ("unit 0", "unit 1", "unit 2")
    lines = str(found).splitlines()
    assert len(lines) <= 30
    assert max(map(len, lines)) <= 80
    assert found.plot("accel_x").get_title() == "accel_x"
    with pytest.raises(gmwm.MissingNameError):
        found.curve("unit 9", "gyro_x")
