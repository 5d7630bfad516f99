"""Trajectories, increments, sensor errors and covariances of small worlds, as recorded."""

from dataclasses import replace

import numpy as np
import pytest

from classes import assert_dataclasses_keep_the_rules, signatures_of
from gmwm import (
    AR,
    BiasInstability,
    GaussMarkov,
    QuantizationNoise,
    RandomWalk,
    RateRamp,
    Resonance,
    Sinusoid,
    WhiteNoise,
)
from gmwm.errors import InputError
from gmwm.ins import (
    Accelerate,
    Climb,
    Experiment,
    Outage,
    Recorded,
    Scenario,
    SensorModels,
    Simulated,
    Stop,
    Straight,
    Trajectory,
    Turn,
    Validation,
    at_epoch,
    barometer,
    car_drive,
    covariance_analysis,
    difference,
    emulate,
    fixed_wing_loiter,
    gnss,
    helicopter_mapping,
    innovation_test,
    integrate,
    navigate,
    over_time,
    perform,
    preintegrate,
    spread,
    standstills,
    through,
)
from gmwm.ins.simulation.outage_errors import sizes
from gmwm.readers import Recording
from recorded import Pictures, assert_as_recorded, summed

START = (0.8, 0.15, 400.0)
MODELS = SensorModels.of(
    {
        "gyro": WhiteNoise(1e-4) + GaussMarkov(2e-4, 20.0),
        "accel_x": WhiteNoise(1e-3) + GaussMarkov(3e-3, 50.0),
        "accel_y": WhiteNoise(1e-3) + RandomWalk(1e-4),
        "accel_z": WhiteNoise(1e-3) + QuantizationNoise(1e-4),
    },
    {"gyro": 1e-4, "accel": 0.01},
)
POOR = SensorModels.of({"gyro": WhiteNoise(1e-4), "accel": WhiteNoise(1e-3)})


def manoeuvred(dt=0.2):
    return perform(
        [
            Straight(3.0), Accelerate(12.0), Turn(1.2, 0.2), Climb(15.0, 0.1), Straight(4.0),
            Turn(-0.7, 0.15), Accelerate(5.0, 0.5), Stop(4.0), Accelerate(8.0), Climb(-6.0, 0.05),
        ],
        start=START, heading=0.4, dt=dt,
    )  # fmt: skip


def world():
    truth = helicopter_mapping(duration=130.0, dt=0.1).segment(70.0, 130.0)
    aiding = gnss(truth, velocity_sd=0.1, lever_arm=(1.0, 0.3, -1.0), coloured_sd=(1.0, 1.0, 2.0),
                  imu=emulate(truth))  # fmt: skip
    aiding = aiding + barometer(truth, 2.0, 1.5) + standstills(truth, 5.0)
    return Scenario(truth, aiding, (Outage(30.0, 10.0), Outage(55.0, 5.0)), interval=5.0)


def test_trajectories():
    car, plane = car_drive(duration=300.0, dt=0.5), fixed_wing_loiter(duration=200.0, dt=0.5)
    found = {
        "helicopter": helicopter_mapping(duration=400.0, dt=0.5), "car": car, "plane": plane,
        "other helicopter": helicopter_mapping(
            start=START, heading=1.0, speed=25.0, strip=700.0, spacing=120.0,
            duration=300.0, dt=0.5,
        ),
        "manoeuvres": manoeuvred(),
    }  # fmt: skip
    assert_as_recorded("ins/trajectories", found)


def test_routes():
    points = [(0.8, 0.15, 400.0), (0.80002, 0.15, 400.0), (0.80003, 0.15009, 406.0),
              (0.80001, 0.15016, 404.0)]  # fmt: skip
    assert_as_recorded(
        "ins/routes",
        [
            through(points, speed=12.0, turn_rate=0.2, dt=0.2),
            through(points[:2], speed=8.0, turn_rate=0.1, dt=0.5),
        ],
    )


def test_emulated_increments_and_what_comes_back():
    truth = manoeuvred(0.05)
    imu = emulate(truth)
    rng = np.random.default_rng(1)
    noisy = imu.with_errors(*(1e-3 * rng.normal(size=(2, imu.n, 3))))
    state = truth.state(0)
    arrays = Trajectory.from_arrays(0.5, car_drive(duration=60.0, dt=0.5).lla,
                                    car_drive(duration=60.0, dt=0.5).rpy)  # fmt: skip
    back = integrate(imu, state)
    found = {"imu": imu, "noisy": noisy, "rate": imu.rate, "state": state, "arrays": arrays,
             "back": back, "segment": truth.segment(5.0, 9.0)}  # fmt: skip
    assert np.max(np.abs(back.lla[:, 2] - truth.lla[:, 2])) < 0.02
    assert_as_recorded("ins/increments", found, rtol=1e-7)


def test_preintegrated_increments():
    imu = emulate(manoeuvred(0.05))
    part = replace(imu, rotation=imu.rotation[100:160], velocity=imu.velocity[100:160])
    full = {
        "gyro_x": WhiteNoise(1e-4) + GaussMarkov(2e-4, 2.0) + Resonance(1e-4, 3.0, 0.1),
        "gyro_y": WhiteNoise(1e-4) + QuantizationNoise(1e-5), "gyro_z": RandomWalk(1e-4),
        "accel": WhiteNoise(1e-3) + AR([0.5], 1e-6) + Sinusoid(1e-3, 2.0),
    }  # fmt: skip
    found = {start: preintegrate(part, full, start) for start in ("known", "stationary")}
    assert_as_recorded("ins/preintegration", found, rtol=1e-7)


def test_sensor_errors():
    every = {
        "gyro": WhiteNoise(1e-4) + GaussMarkov(2e-4, 2.0) + RateRamp(1e-6),
        "accel_x": WhiteNoise(1e-3) + BiasInstability(1e-3), "accel_y": RandomWalk(1e-4),
        "accel_z": WhiteNoise(1e-3) + Sinusoid(1e-3, 2.0),
    }  # fmt: skip
    models = SensorModels.of(every, {"gyro": 1e-4, "accel_z": 0.01})
    drawn = models.simulate(300, 0.05, np.random.default_rng(3))
    rng = np.random.default_rng(4)
    values = {f"{kind}_{axis}": size * rng.normal(size=4000) + 1e-6 * np.arange(4000)
              for kind, size in (("gyro", 1e-3), ("accel", 1e-2)) for axis in "xyz"}  # fmt: skip
    recording = Recording.from_arrays(values, 100.0, {"gyro": "rad/s", "accel": "m/s^2"})
    source = Recorded.of(recording, 9.0)
    runs = [source.draw(run, 900, 0.01, np.random.default_rng(run)) for run in (0, 3)]
    found = {"drawn": drawn, "runs": runs, "available": source.available, "repr": repr(source),
             "notices": [each.text for each in models.notices]}  # fmt: skip
    assert_as_recorded("ins/sensor_errors", found)


def test_a_filter():
    scenario = world()
    truth = scenario.trajectory
    imu = emulate(truth)
    errors = MODELS.simulate(imu.n, imu.dt, np.random.default_rng(5)).total
    imu = imu.with_errors(errors[:, :3], errors[:, 3:])
    aiding = scenario.aiding.noisy(np.random.default_rng(6)).without(scenario.outages)
    found = {}
    for name, models, second in (("good", MODELS, True), ("poor", POOR, False)):
        solution = navigate(imu, truth.state(0), models, aiding, interval=10.0, second_order=second)
        found[name] = [solution, solution.errors(truth), solution.sd, solution.rpy,
                       solution.innovations.nis, solution.innovations.standard]  # fmt: skip
    assert_as_recorded("ins/filter", found)


def test_many_runs_and_what_is_said_of_them():
    scenario = world()
    filters = {"right": MODELS, "poor": POOR}
    validation = Validation.of(Experiment(scenario, Simulated(MODELS), filters, MODELS, 4, 7))
    study = validation.study
    found = {}
    for name in study.filters:
        runs = study[name]
        summaries = {
            "end": at_epoch(runs, runs.index(40.0)), "over": over_time(runs, 0.0, 30.0),
            "test": innovation_test(runs), "spread": spread(runs, 40.0),
        }  # fmt: skip
        found |= {f"{name} {of}": summed(each) for of, each in summaries.items()}
        found[name] = runs
    both = [sizes(study[name], 40.0) for name in filters]
    found["difference"] = summed([difference(*both, quantity) for quantity in both[0]])
    found |= {"text": str(validation), "notices": validation.notices}
    assert_as_recorded("ins/monte_carlo", found, rtol=1e-5)


def test_covariances_without_runs():
    scenario = world()
    found = {}
    for name, believed in (("right", MODELS), ("poor", POOR)):
        analysis = covariance_analysis(scenario, MODELS, believed)
        found[name] = [analysis, analysis.sd, analysis.predicted_sd, analysis.nees(),
                       analysis.score(slice(0, 6))]  # fmt: skip
    assert_as_recorded("ins/covariance_analysis", found)


def test_no_ins_dataclass_changes():
    by_identity = (
        "Reduction Comparison Explanation Candidate FarStamps Faults ImuLog Measured Navigated "
        "Replay _Block Scenario Experiment MonteCarlo _Task Validation _Believed"
    )
    assert_dataclasses_keep_the_rules("ins", by_identity)


def test_arguments_of_the_ins_room_and_their_defaults():
    assert_as_recorded("ins/interface_ins", signatures_of("ins"))


def test_what_is_drawn_of_many_runs(monkeypatch):
    pictures = Pictures(monkeypatch)
    filters = {"right": MODELS, "poor": POOR}
    made = Validation.of(Experiment(world(), Simulated(MODELS), filters, MODELS, 2, 7))
    made.plot_track()
    made.plot_errors(1)
    made.plot_growth()
    for wrong in (-1, 2):
        with pytest.raises(InputError, match="experiment has 2 of them"):
            made.plot_errors(wrong)
    assert_as_recorded("ins/drawn_runs", pictures.asked, rtol=1e-5)
