"""The main job, its file format, and what happens to bad channels and bad files."""

import json
from dataclasses import replace

import numpy as np
import pytest

import gmwm
from gmwm import Calibration, GaussMarkov, InputError, RandomWalk, RateRamp, Recording, WhiteNoise
from gmwm.calibration import tuning
from gmwm.issues import Notice
from marks import slow
from places import SHARED

DT = 0.01
DATA = SHARED / "data"
GYRO = WhiteNoise(4e-4) + RandomWalk(2e-4)
ACCEL = WhiteNoise(1e-3)


UNUSED = Notice("columns-not-used", "note", "", "column not used: 'temp'")

MODELS = {
    "gyro_x": GYRO.opened() + RateRamp(),
    "gyro_y": WhiteNoise(),
    "accel_x": WhiteNoise() + RandomWalk(),
    "accel_y": WhiteNoise() + GaussMarkov(tau=50.0),
}


def channel(name, values):
    quantity = name.split("_")[0]
    return gmwm.Channel(name, values, DT, quantity, {"gyro": "rad/s", "accel": "m/s^2"}[quantity])


def as_recording(values, source="", rate=100.0):
    return Recording.from_arrays({"gyro_x": values}, rate, {"gyro": "rad/s"}, source)


@pytest.fixture(scope="module")
def recording():
    rng = np.random.default_rng(13)
    n = 10_000
    return Recording(
        (
            channel("gyro_x", GYRO.simulate(n, DT, rng)),
            channel("gyro_y", np.full(n, 0.25)),
            channel("accel_x", ACCEL.simulate(n, DT, rng) + 9.8),
            channel("accel_y", ACCEL.simulate(n, DT, rng)),
        ),
        source="bench.csv",
        notices=(UNUSED,),
    )


@pytest.fixture(scope="module")
def calibration(recording):
    return gmwm.calibrate(recording)


@pytest.fixture(scope="module")
def mapped(recording):
    """With every kind of parameter: estimated, given, at its bound, and a ramp."""
    return gmwm.calibrate(recording, MODELS, jobs=1)


# -- calibrate ------------------------------------------------------------------------------------


def test_every_live_channel_has_a_fit_that_holds_the_truth(calibration):
    assert list(calibration) == ["gyro_x", "accel_x", "accel_y"]
    assert len(calibration) == 3
    assert {"N", "K"} <= calibration["gyro_x"].params.keys()
    for name, truth in (("gyro_x", GYRO), ("accel_x", ACCEL), ("accel_y", ACCEL)):
        low, high = calibration[name].interval(0.999)["N"]
        assert low < gmwm.process.as_model(truth).params["N"] < high
        assert calibration[name].wv.name == name
    low, high = calibration["gyro_x"].interval(0.999)["K"]
    assert low < 2e-4 < high


def test_dead_channel_is_named_and_skipped(calibration):
    (notice,) = calibration.skipped.values()
    assert (notice.code, notice.where, notice.severity) == ("constant", "gyro_y", "bad")
    assert str(notice) == "gyro_y: constant at 0.25 rad/s"
    assert "gyro_y: skipped, constant at 0.25 rad/s" in str(calibration)
    assert not calibration.valid
    with pytest.raises(InputError, match=r"'gyro_y': constant at 0\.25 rad/s"):
        calibration["gyro_y"]
    assert "gyro_y" not in calibration


def test_files_keep_rivals_and_what_was_left_out(calibration, tmp_path):
    rivals = {"gyro_x": (WhiteNoise(1e-3) + RandomWalk(1e-4),)}
    spans = {"gyro_x": ((10, 20), (40, 41))}
    changed = replace(calibration, rivals=rivals, left_out=spans)
    again = gmwm.load(changed.save(tmp_path / "a.json"))
    assert (again.rivals, again.left_out) == (rivals, spans)
    # Files of before have neither.
    stored = calibration.to_dict()
    del stored["rivals"], stored["left_out"]
    again = Calibration.from_dict(stored)
    assert again.rivals == again.left_out == {}


def test_valid_only_if_every_fit_is(calibration):
    sound = replace(calibration, skipped={})
    assert sound.valid == all(fit.valid for fit in calibration.fits.values())
    fits = {name: replace(fit, notices=()) for name, fit in calibration.fits.items()}
    assert replace(sound, fits=fits).valid
    assert not replace(calibration, fits=fits).valid  # one is skipped
    bad = replace(fits["gyro_x"], notices=(Notice("misfit", "bad", "", "misses the data"),))
    assert not replace(sound, fits=fits | {"gyro_x": bad}).valid


def test_all_channels_dead():
    rec = Recording(
        (channel("gyro_x", np.zeros(100)), channel("accel_x", np.ones(100))), "dead.csv"
    )
    with pytest.raises(InputError, match=r"^dead\.csv: every channel is constant.*: check the"):
        gmwm.calibrate(rec)


def test_too_short_a_recording():
    rec = Recording((channel("gyro_x", np.arange(7.0)),))
    with pytest.raises(InputError, match=r"^7 samples are too few: record at least 8"):
        gmwm.calibrate(rec)


def test_an_infinite_sample_stops_no_other_channel(recording):
    values = recording["accel_y"].values.copy()
    values[17] = np.inf
    rec = Recording((recording["gyro_x"], channel("accel_y", values)))
    result = gmwm.calibrate(rec, WhiteNoise())
    assert list(result) == ["gyro_x"]
    assert "'accel_y' has 1 " in result.skipped["accel_y"].text
    assert "index 17" in result.skipped["accel_y"].text


@pytest.mark.parametrize("lost", [0.6, 1.0])
def test_what_made_most_samples_missing_is_named(tmp_path, lost):
    rng = np.random.default_rng(2)
    rows = 1e-3 * rng.standard_normal((5000, 2))
    rows[: int(lost * 5000), 1] = [-999.0]
    rows[:70, 1] = 1e-3
    path = tmp_path / "a.csv"
    np.savetxt(path, rows, delimiter=",", header="gyro_x [rad/s],gyro_y [rad/s]", comments="")
    result = gmwm.calibrate(gmwm.read(path, rate=100.0), WhiteNoise())
    text = result.skipped["gyro_y"].text
    assert "more than half: " in text and "samples are -999, an error code" in text


def test_channels_of_which_too_much_is_missing_are_skipped(recording):
    n = recording.n
    values = recording["accel_y"].values.copy()
    values[: n // 2] = np.nan
    half = channel("accel_y", values)
    less = channel("accel_z", np.where(np.arange(n) == n - 1, np.nan, values))
    none = channel("gyro_y", np.full(n, np.nan))
    dead = channel("gyro_z", np.where(np.arange(n) < 10, np.nan, 2.5))
    result = gmwm.calibrate(Recording((half, less, none, dead)), {"accel_y": WhiteNoise()})
    assert list(result) == ["accel_y"]
    assert {name: notice.text for name, notice in result.skipped.items()} == {
        "accel_z": f"{n // 2 + 1:,} of {n:,} samples missing, more than half",
        "gyro_y": "all samples missing",
        "gyro_z": "constant at 2.5 rad/s",
    }
    with pytest.raises(InputError, match=r"gyro_y: all samples missing; gyro_z: constant.*check"):
        gmwm.calibrate(Recording((none, dead)))


STEPS = np.arange(10_000)


@pytest.mark.parametrize(
    ("values", "model"),
    [
        pytest.param(STEPS % 2 / 8.0, None, id="toggling"),
        slow((STEPS % 4 < 2) / 8.0, WhiteNoise() + RandomWalk(), id="toggling in twos"),
        slow(STEPS / 8.0, None, id="straight line"),
        slow(STEPS / 8.0, WhiteNoise() + RandomWalk(), id="straight line, given"),
        slow(np.sin(0.05 * STEPS), None, id="sine"),
    ],
)
def test_a_channel_that_no_noise_describes_does_not_stop_the_others(recording, values, model):
    # Without any noise the wavelet variance is exactly zero at some averaging times.
    rec = Recording((recording["gyro_x"], channel("gyro_z", values)))
    result = gmwm.calibrate(rec, model)
    assert "gyro_x" in result.fits
    assert "gyro_z" in result.skipped or not result["gyro_z"].valid
    if "gyro_z" in result.skipped:
        assert (
            "gyro_z" in result.skipped["gyro_z"].text or "constant" in result.skipped["gyro_z"].text
        )


def test_one_model_for_all_channels(recording):
    result = gmwm.calibrate(recording, WhiteNoise())
    assert [list(fit.params) for fit in result.fits.values()] == [["N"]] * 3


def test_a_model_by_channel(mapped):
    assert list(mapped["gyro_x"].params) == ["N", "K", "R"]
    assert list(mapped["accel_x"].params) == ["N", "K"]
    assert mapped["accel_y"].params["tau"] == 50.0
    assert "tau" not in mapped["accel_y"].keys


def test_a_mapping_must_have_every_live_channel(recording):
    models = dict.fromkeys(("gyro_x", "gyro_y", "accel_x"), WhiteNoise())
    with pytest.raises(InputError, match="no model is given for channel 'accel_y': add one"):
        gmwm.calibrate(recording, models)


@pytest.mark.slow
def test_processes_change_no_bit(recording, mapped, monkeypatch):
    monkeypatch.setattr(tuning, "WORTH_PROCESSES", 0)
    monkeypatch.setattr("os.cpu_count", lambda: 2)
    heard = []
    shared = gmwm.calibrate(recording, MODELS, progress=lambda *told: heard.append(told))
    assert sorted(name for *_, name in heard[:-1]) == sorted(shared.fits)
    assert_same(shared, mapped)
    assert shared.to_dict() == mapped.to_dict()
    assert not any(fit.covariance.flags.writeable for fit in shared.values())


# -- files ----------------------------------------------------------------------------------------


def assert_same(one, other):
    assert one.to_dict() == other.to_dict()
    assert (str(one), one.valid) == (str(other), other.valid)
    for a, b in zip(one.fits.values(), other.fits.values(), strict=True):
        assert (a.model, a.estimates, a.reasons) == (b.model, b.estimates, b.reasons)
        assert a.interval(0.5) == b.interval(0.5)
        for array in ("tau", "variance", "mean", "blocks", "lower", "upper", "covariance"):
            np.testing.assert_array_equal(getattr(a.wv, array), getattr(b.wv, array))
        np.testing.assert_array_equal(a.implied, b.implied)


@pytest.mark.parametrize("which", ["calibration", "mapped"])
def test_round_trip_through_a_file(which, request, tmp_path):
    original = request.getfixturevalue(which)
    path = tmp_path / "cal.json"
    assert original.save(path) == path
    again = gmwm.load(path)
    assert isinstance(again, Calibration)
    assert_same(again, original)
    again.save(tmp_path / "again.json")
    assert (tmp_path / "again.json").read_bytes() == path.read_bytes()


def test_an_upper_bound_is_in_the_round_trip(mapped):
    # What `mapped` is for: a bound and a notice must exist to be lost.
    fit = mapped["accel_x"]
    assert fit.upper_bounds.keys() == {"K"}
    assert [(n.code, n.where) for n in fit.notices] == [("amplitude-bound", "K")]


@pytest.mark.parametrize(
    ("name", "changes"),
    [
        ("gyro_x", {"chi_square": float("nan"), "dof": 0}),
        ("accel_x", {"upper_bounds": {"K": float("inf")}}),
    ],
)
def test_numbers_that_are_not_finite_survive(mapped, tmp_path, name, changes):
    odd = replace(mapped, fits={name: replace(mapped[name], **changes)})
    assert_same(gmwm.load(odd.save(tmp_path / "cal.json")), odd)


def test_the_file_is_plain_json_in_si(calibration, tmp_path):
    content = json.loads(calibration.save(tmp_path / "cal.json").read_text())
    assert content["schema"] == "gmwm.calibration"
    assert content["schema_version"] == 2
    assert content["rate_hz"] == pytest.approx(100.0)
    gyro = content["channels"]["gyro_x"]
    assert gyro["params"] == calibration["gyro_x"].params
    assert gyro["units"]["N"] == "rad/s/sqrt(Hz)"
    assert gyro["units"]["K"] == "rad/s^2/sqrt(Hz)"


# -- files that are not ours, or not whole --------------------------------------------------------


def refused(path):
    with pytest.raises(InputError) as caught:
        gmwm.load(path)
    message = str(caught.value)
    assert message.startswith(f"{path}: ")
    assert len(message.splitlines()) == 1
    assert message.count(": ") >= 2, "no hint is given"
    return message


def test_missing_file_and_folder(tmp_path):
    assert "cannot be read" in refused(tmp_path / "nowhere.json")
    assert "cannot be read" in refused(tmp_path)


@pytest.mark.parametrize("version", [0, 1, "2", None])
def test_other_schema_versions(calibration, tmp_path, version):
    path = tmp_path / "cal.json"
    path.write_text(json.dumps(calibration.to_dict() | {"schema_version": version}))
    message = refused(path)
    assert f"schema version {version!r}" in message
    assert "make the calibration again or update gmwm" in message


FIT = ("channels", "gyro_x")
WV = (*FIT, "wavelet_variance")


@pytest.mark.parametrize(
    ("place", "value"),
    [
        ((*FIT, "model"), []),
        ((*FIT, "model", 0, "process"), "PinkNoise"),
        ((*FIT, "model", 0, "M"), 1.0),
        ((*FIT, "model", 0, "N"), None),
        ((*FIT, "keys"), ["N", "X"]),
        ((*WV, "dt"), None),
        ((*WV, "tau"), ["a", "b"]),
        (FIT, None),
        (("channels",), []),
    ],
)
def test_damaged_files(calibration, tmp_path, place, value):
    # More of them are in tests/unit/_core/test_documents.py.
    content = json.loads(json.dumps(calibration.to_dict()))
    place_in(content, place)[place[-1]] = value
    (tmp_path / "cal.json").write_text(json.dumps(content))
    refused(tmp_path / "cal.json")


@pytest.mark.parametrize(
    "place",
    [
        *[(key,) for key in ("channels", "skipped", "source", "rate_hz", "n", "notices")],
        *[(*FIT, key) for key in ("model", "keys", "covariance", "upper_bounds", "objective")],
        *[(*FIT, "notices"), (*WV, "variance"), (*WV, "dt")],
    ],
    ids=".".join,
)
def test_files_that_lack_something(calibration, tmp_path, place):
    content = json.loads(json.dumps(calibration.to_dict()))
    del place_in(content, place)[place[-1]]
    (tmp_path / "cal.json").write_text(json.dumps(content))
    refused(tmp_path / "cal.json")


def place_in(content, place):
    for key in place[:-1]:
        content = content[key]
    return content


def repeated(*seeds):
    truth = gmwm.WhiteNoise(1e-3) + gmwm.GaussMarkov(1e-3, 0.5)
    return [as_recording(truth.simulate(20_000, 0.01, seed), f"rec{seed}") for seed in seeds]


def test_several_recordings_have_one_model_with_a_test_of_equality(tmp_path):
    calibration = gmwm.calibrate(repeated(1, 2, 3), WhiteNoise() + GaussMarkov())
    fit = calibration["gyro_x"]
    assert len(fit.parts) == 3
    assert fit.equality_p > 0.001
    assert calibration.n == 60_000
    assert calibration.source == "rec1, rec2, rec3"
    again = gmwm.load(calibration.save(tmp_path / "cal.json"))["gyro_x"]
    assert again.params == fit.params
    assert again.equality_p == fit.equality_p
    np.testing.assert_allclose(again.wv.covariance, fit.wv.covariance)
    assert str(again) == str(fit)
    assert "Gauss-Markov" in calibration.report(tmp_path / "r.html").read_text()


def test_a_channel_dead_in_one_recording_is_taken_from_the_others():
    first, second = repeated(1, 2)
    calibration = gmwm.calibrate(
        [as_recording(np.ones(20_000), "dead"), first, second], WhiteNoise()
    )
    assert len(calibration["gyro_x"].parts) == 2
    assert calibration.skipped == {}


def test_recordings_of_other_rates_are_refused():
    (first,) = repeated(1)
    other = as_recording(np.random.default_rng(1).standard_normal(5000), "slow", rate=50.0)
    with pytest.raises(gmwm.InputError, match="slow has 50 Hz and rec1 100 Hz"):
        gmwm.calibrate([first, other])
    with pytest.raises(gmwm.InputError, match="no recording"):
        gmwm.calibrate([])


def noisy_recording(seed=5):
    """A line, a shock and a channel that is left alone."""
    rng = np.random.default_rng(seed)
    t = np.arange(20_000) * 0.01
    accel = gmwm.WhiteNoise(1e-3).simulate(t.size, 0.01, rng) + 0.01 * np.sin(2 * np.pi * 0.7 * t)
    gyro = gmwm.WhiteNoise(1e-3).simulate(t.size, 0.01, rng)
    gyro[10_000:10_020] += 1.0
    return gmwm.Recording.from_arrays(
        {"gyro_x": gyro, "accel_x": accel}, 100.0, {"gyro": "rad/s", "accel": "m/s^2"}
    )


def test_issues_are_reported_and_screened():
    calibration = gmwm.calibrate(noisy_recording())
    assert calibration["gyro_x"].params["N"] == pytest.approx(1e-3, rel=0.03)
    assert calibration["gyro_x"].wv.gaps.missing > 0
    line = calibration["accel_x"].params
    assert line["sinusoid_frequency"] == pytest.approx(0.7, abs=1e-3)
    assert line["sinusoid_amplitude"] == pytest.approx(0.01, rel=0.1)
    told = " ".join(map(str, calibration.notices))
    assert "accel_x: a periodic line at 0.7" in told
    assert "(modelled, but not in filter N and K)" in told
    assert "gyro_x: a spike or shock" in told
    assert f"(left out, {calibration['gyro_x'].wv.gaps.missing} samples)" in told
    assert calibration.notices[0].code == "events-left-out"


def test_notices_survive_the_file(tmp_path):
    calibration = gmwm.calibrate(noisy_recording(), WhiteNoise())
    assert {found.code for found in calibration.notices} >= {"event", "line", "length"}
    line = next(found for found in calibration.notices if found.code == "line")
    assert line.hint == "not tried as a term of the model"  # which was given
    path = calibration.save(tmp_path / "cal.json")
    assert gmwm.load(path).notices == calibration.notices
    content = json.loads(path.read_text())
    content["notices"] = [{"code": "line"}]
    path.write_text(json.dumps(content))
    with pytest.raises(InputError, match=r"notices\.0: not a notice"):
        gmwm.load(path)


def test_notices_of_several_recordings_say_which():
    first, second = noisy_recording(), noisy_recording(seed=6)
    both = [replace(first, source="a.csv"), replace(second, source="b.csv")]
    found = gmwm.calibrate(both, WhiteNoise()).notices
    assert {one.source for one in found} == {"a.csv", "b.csv"}
    assert str(found[0]).startswith("a.csv: ")


def contaminated(share, size, n=30_000, seed=3):
    """White noise of which some samples have a standard deviation ``size`` times as large."""
    rng = np.random.default_rng(seed)
    noise = WhiteNoise(1e-3).simulate(n, 0.01, rng)
    return noise * np.where(rng.random(n) < share, size, 1.0)


@pytest.mark.parametrize(
    ("share", "size"), [(0.01, 4.0), slow(0.01, 30.0), slow(0.03, 10.0), (0.05, 100.0)]
)
def test_outliers_all_over_the_record_are_left_out(share, size):
    recording = as_recording(contaminated(share, size))
    calibration = gmwm.calibrate(recording, WhiteNoise() + RandomWalk())
    fit = calibration["gyro_x"]
    assert fit.wv.efficiency == 1.0
    assert not fit.wv.notices  # gaps leave long averaging times
    assert 0.1 * share < fit.wv.gaps.missing / fit.wv.n < 2.5 * share
    (found,) = [found for found in calibration.notices if found.code == "outliers"]
    assert found.values["left_out"]
    plain = gmwm.calibrate(recording, WhiteNoise(), screening=["lines", "resonances"])["gyro_x"]
    assert plain.wv.gaps is None
    truth = 0.5 * 1e-3**2 / 0.01  # Haar wavelet variance of the noise at the first level
    # The mean square is too high by share (size^2 - 1) of the variance.
    raised = plain.wv.variance[0] / truth - 1.0
    assert raised > 0.5 * share * (size**2 - 1.0)
    assert abs(fit.wv.variance[0] / truth - 1.0) < 0.3 * raised
    # What is left is white: it does not depend on the level that outliers are distant from.
    ratio = fit.wv.variance[7] / fit.wv.variance[0] * 2.0**7
    assert abs(ratio - 1.0) < 4.0 * np.sqrt(2.0 / fit.wv.dof[7])


def test_more_outliers_than_can_be_left_out_make_the_variances_robust():
    calibration = gmwm.calibrate(as_recording(contaminated(0.15, 30.0)), WhiteNoise())
    fit = calibration["gyro_x"]
    assert fit.wv.efficiency < 1.0
    assert fit.wv.gaps is None
    (found,) = [found for found in calibration.notices if found.code == "outliers"]
    assert not found.values["left_out"]


def heavy(law, n, seed):
    """White noise 1e-4 of heavy tails, on a random walk of 2e-6, at 100 Hz."""
    rng = np.random.default_rng(seed)
    walk = RandomWalk(2e-6).simulate(n, 0.01, rng)
    draw = {
        "laplace": lambda: rng.laplace(size=n) / np.sqrt(2.0),
        "t3": lambda: rng.standard_t(3, n) / np.sqrt(3.0),
        "t5": lambda: rng.standard_t(5, n) / np.sqrt(5.0 / 3.0),
        "uniform": lambda: rng.uniform(-1.0, 1.0, n) * np.sqrt(3.0),
    }
    return walk + 1e-3 * draw[law]()


@pytest.mark.parametrize("law", ["laplace", slow("t3"), slow("t5"), "uniform"])
def test_white_noise_of_heavy_tails_is_white_noise(law):
    # One hour. Robust variances are a sixth to a half too small at the finest level only, which
    # took the white noise for a random walk or a ramp with Gauss-Markov processes.
    values = heavy(law, 360_000, 5)
    calibration = gmwm.calibrate(as_recording(values))
    fit = calibration["gyro_x"]
    assert fit.wv.efficiency == 1.0
    assert set(fit.params) == {"N", "K"}
    assert fit.valid
    codes = {found.code for found in calibration.notices}
    assert ("heavy-tails" in codes) == (law != "uniform")
    assert "outliers" not in codes
    for key, truth in (("N", 1e-4), ("K", 2e-6)):
        low, high = fit.interval(0.999)[key]
        assert low < truth < high


@pytest.mark.parametrize("step", [0.0, slow(0.5), 1.0, slow(2.0)])
def test_clean_and_rounded_noise_stays_as_it_is(step):
    values = WhiteNoise(1e-3).simulate(60_000, 0.01, 8)
    if step:
        values = step * 0.01 * np.rint(values / (step * 0.01))
    calibration = gmwm.calibrate(as_recording(values), WhiteNoise())
    assert calibration["gyro_x"].wv.efficiency == 1.0
    assert "outliers" not in {found.code for found in calibration.notices}


def test_a_real_recording_with_outliers():
    path = DATA / "mtig" / "mtig_contaminated_gyro_x.csv.gz"
    if not path.exists():
        pytest.skip("the recordings are not part of the package")
    recording = gmwm.read(path, rate=100, units={"gyro": "rad/s"})
    calibration = gmwm.calibrate(recording, WhiteNoise() + RandomWalk())
    # Half of its samples are five times as large as the others, independently of each other: white.
    assert calibration["gyro_x"].wv.efficiency == 1.0
    assert "heavy-tails" in {found.code for found in calibration.notices}
    plain = gmwm.wavelet_variance(recording["gyro_x"]).variance[0]
    assert calibration["gyro_x"].wv.variance[0] < 0.97 * plain


def test_screening_can_be_left_out():
    calibration = gmwm.calibrate(noisy_recording(), WhiteNoise() + RandomWalk(), screening=())
    assert not {notice.code for notice in calibration.notices} & {"event", "line", "outliers"}
    assert not calibration.is_examined
    assert calibration["gyro_x"].wv.gaps is None
    assert "sinusoid_amplitude" not in calibration["accel_x"].params
    with pytest.raises(gmwm.InputError, match="choose from events, lines, resonances, outliers"):
        gmwm.calibrate(noisy_recording(), screening=["magic"])


def test_a_channel_of_repeated_samples_is_calibrated_at_its_own_rate():
    rng = np.random.default_rng(8)
    gyro, slow = rng.normal(size=20_000), rng.normal(size=10_000)
    values = {"gyro_x": gyro, "accel_x": np.repeat(slow, 2)}
    recording = Recording.from_arrays(values, 200.0, {"gyro": "rad/s", "accel": "m/s^2"})
    found = gmwm.calibrate(recording, WhiteNoise())
    assert not found.skipped
    assert found["accel_x"].wv.dt == pytest.approx(0.01)
    assert found["gyro_x"].wv.dt == pytest.approx(0.005)
    # White noise of one sample a 10 ms: N^2 = variance dt.
    assert found["accel_x"]["N"].value == pytest.approx(0.1, rel=0.03)
    assert "repeated-samples" in {notice.code for notice in found.notices}


def test_fits_of_a_record_whose_rate_changed_are_not_valid():
    notice = Notice("rate-changes", "bad", "", "the sampling rate goes from 100 to 71 Hz")
    noise = np.random.default_rng(1).normal(size=5000)
    rec = Recording.from_arrays({"gyro_x": noise}, 100.0, {"gyro": "deg/s"}, "", [notice])
    fit = gmwm.calibrate(rec, WhiteNoise())["gyro_x"]
    assert not fit.valid
    assert list(fit.reasons) == ["rate_constant"]
