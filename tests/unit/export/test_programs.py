"""Every program, with the numbers of its file in its own equations, has the errors that are meant.

Each ``Step`` is one step of a program as its source has it, for one axis: the integral of the
sensor's error, and its bias. Expectations are exact: covariances are propagated, nothing is drawn.
The file that is parsed is the one that is written.
"""

import json
import re
import shutil
import subprocess
import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass
from math import exp, radians, sqrt

import numpy as np
import pytest
import yaml

import gmwm
from gmwm.export import TARGETS
from imu_numbers import FORMS, RATE, SIGMA, TAU, K, N, numbers

DT = 1.0 / RATE
STEPS = 2000
TOLERANCE = 0.03
F = np.array([[1.0, DT], [0.0, 1.0]])


@dataclass
class Step:
    """x[k+1] = F x[k] + noise of covariance ``noise``, x = (integral of the error, bias)."""

    transition: np.ndarray
    noise: np.ndarray
    dt: float = DT


def file_of(name, **changes):
    return gmwm.export(numbers(TARGETS[name].form, **changes), name)


def yaml_of(name):
    text = file_of(name)
    return yaml.safe_load(text.removeprefix("%YAML:1.0\n"))


LARGEST = {q: (max(N[q]), max(K[q])) for q in N}
"""What files with one value for three axes are to hold."""


def continuous(noise, walk, dt=DT):
    """Densities that the program turns into those of a step: N^2/dt (dt)^2, K^2 dt."""
    return Step(np.array([[1.0, dt], [0.0, 1.0]]), np.diag([noise**2 / dt * dt**2, walk**2 * dt]))


# -- one value for three axes: file -> the program's step -----------------------------------------


def kalibr(q):
    content = yaml_of("kalibr")
    sensor = {"gyro": "gyroscope", "accel": "accelerometer"}[q]
    # ConfigReader.py: uncertaintyDiscrete = density / sqrt(1/update_rate)
    sample = content[f"{sensor}_noise_density"] / sqrt(1.0 / content["update_rate"])
    # IccSensors.py addBiasMotionTerms: the integral of (db/dt)^2/walk^2
    walk = content[f"{sensor}_random_walk"]
    return Step(F, np.diag([sample**2 * DT**2, walk**2 * DT]))


def openvins(q):
    content = yaml_of("openvins")["imu0"]
    sensor = {"gyro": "gyroscope", "accel": "accelerometer"}[q]
    noise, walk = content[f"{sensor}_noise_density"], content[f"{sensor}_random_walk"]
    # Propagator.cpp predict_and_compute: Qc = diag(sigma^2/dt, walk^2/dt), G = diag(dt, dt)
    return Step(F, np.diag([noise**2 / DT * DT**2, walk**2 / DT * DT**2]))


def vins(q):
    content = yaml_of("vins")
    letter = {"gyro": "gyr", "accel": "acc"}[q]
    noise, walk = content[f"{letter}_n"], content[f"{letter}_w"]
    # integration_base.h midPointIntegration: V has dt/2 for each end of the step, dt for the walk
    v = np.array([[0.5 * DT, 0.5 * DT, 0.0], [0.0, 0.0, DT]])
    return Step(F, v @ np.diag([noise**2, noise**2, walk**2]) @ v.T)


def orbslam3(q):
    content = yaml_of("orbslam3")
    word = {"gyro": "Gyro", "accel": "Acc"}[q]
    root = sqrt(content["IMU.Frequency"])
    # Tracking.cc: Calib(Tbc, Ng sf, Na sf, Ngw/sf, Naw/sf); ImuTypes.cc: C += B Nga B', B = dt
    noise, walk = content[f"IMU.Noise{word}"] * root, content[f"IMU.{word}Walk"] / root
    return Step(F, np.diag([(noise * DT) ** 2, walk**2]))


def fastlio(q):
    content = yaml_of("fastlio")["mapping"]
    letter = {"gyro": "gyr", "accel": "acc"}[q]
    # esekfom.hpp predict: P += (dt f_w) Q (dt f_w)'
    q_matrix = np.diag([content[f"{letter}_cov"], content[f"b_{letter}_cov"]])
    return Step(F, DT**2 * q_matrix)


def liosam(q):
    content = yaml_of("liosam")["lio_sam"]
    letter = {"gyro": "Gyr", "accel": "Acc"}[q]
    # imuPreintegration.cpp: covariance = noise^2 of GTSAM; sigma of a bias step sqrt(dt) times
    return continuous(content[f"imu{letter}Noise"], content[f"imu{letter}BiasN"])


def kimera(q):
    content = yaml_of("kimera")
    sensor = {"gyro": "gyroscope", "accel": "accelerometer"}[q]
    assert content["rate_hz"] == RATE
    # ImuFrontend.cpp: covariance = density^2 of GTSAM; VioBackend.cpp: sqrt(dt) times the walk
    return continuous(content[f"{sensor}_noise_density"], content[f"{sensor}_random_walk"])


def okvis2(q):
    content = yaml_of("okvis2")["imu_parameters"]
    letter = {"gyro": "g", "accel": "a"}[q]
    # ImuError.cpp propagation: P += dt sigma^2
    noise, walk = content[f"sigma_{letter}_c"], content[f"sigma_{letter}w_c"]
    return Step(F, DT * np.diag([noise**2, walk**2]))


def maplab(q):
    content = yaml_of("maplab")["sigmas"]
    word = {"gyro": "gyro", "accel": "acc"}[q]
    # imu-integrator-inl.h: dP/dt = F P + P F' + diag(sigma^2)
    noise = content[f"{word}_noise_density"]
    walk = content[f"{word}_bias_random_walk_noise_density"]
    return Step(F, DT * np.diag([noise**2, walk**2]))


def px4(q):
    # As QGroundControl reads them: lines of five columns that are no comments.
    rows = [row.split("\t") for row in file_of("px4").splitlines() if not row.startswith("#")]
    lines = [row for row in rows if len(row) == 5]
    assert {tuple(line[:2]) for line in lines} == {("1", "1")}
    assert {line[4] for line in lines} == {"9"}  # a 32-bit float, as MAVLink numbers the types
    content = {line[2]: float(line[3]) for line in lines}
    word = {"gyro": "GYR", "accel": "ACC"}[q]
    interval = 0.01  # EKF2_PREDICT_US
    # covariance.cpp predictCovariance: (dt noise)^2, (dt bias noise)^2
    noise, walk = content[f"EKF2_{word}_NOISE"], content[f"EKF2_{word}_B_NOISE"]
    return Step(
        np.array([[1.0, interval], [0.0, 1.0]]),
        np.diag([(interval * noise) ** 2, (interval * walk) ** 2]),
        interval,
    )


ONE_VALUE = (
    kalibr, openvins, vins, orbslam3, fastlio, liosam, kimera, okvis2, maplab, px4,
)  # fmt: skip


# -- three values: file -> the step of each axis --------------------------------------------------


def gtsam_python(q):
    text = file_of("gtsam")
    word = {"gyro": ("Gyroscope", "BiasOmega"), "accel": ("Accelerometer", "BiasAcc")}[q]
    noise, walk = (diagonal(text, rf"set{each}Covariance\(np\.diag\(\[(.*?)\]") for each in word)
    return gtsam_steps(noise, walk)


def gtsam_cpp(q):
    text = file_of("gtsam-cpp")
    word = {"gyro": ("gyroscope", "biasOmega"), "accel": ("accelerometer", "biasAcc")}[q]
    noise, walk = (diagonal(text, rf"{each}Covariance = gtsam::Vector3\((.*?)\)") for each in word)
    return gtsam_steps(noise, walk)


def diagonal(text, pattern):
    return [float(value) for value in re.search(pattern, text).group(1).split(",")]


def gtsam_steps(noise, walk):
    # CombinedImuFactor.cpp integrateMeasurement: dt (wCov/dt) dt, dt biasOmegaCovariance
    return [
        Step(F, np.diag([DT * (a / DT) * DT, DT * b])) for a, b in zip(noise, walk, strict=True)
    ]


def matlab(q):
    text = file_of("matlab")
    block = text[text.index({"gyro": "gyroparams(", "accel": "accelparams("}[q]) :]
    values = {
        key: [float(v) for v in re.search(rf"'{key}', \[(.*?)\]", block).group(1).split()]
        for key in ("NoiseDensity", "RandomWalk")
    }
    assert re.search(r"'NoiseType', '(.*?)'", block).group(1) == "single-sided"
    rate = float(re.search(r"'SampleRate', (.*?),", text).group(1))
    # imuSensor: samples of NoiseDensity sqrt(rate), a walk by RandomWalk/sqrt(rate)
    return [
        Step(F, np.diag([(n * sqrt(rate) * DT) ** 2, k**2 / rate]))
        for n, k in zip(values["NoiseDensity"], values["RandomWalk"], strict=True)
    ]


def basalt(q):
    content = json.loads(file_of("basalt"))["value0"]
    rate = content["imu_update_rate"]
    # calibration.hpp: noise sqrt(rate); imu_block.hpp: weight of a step 1/(bias_std sqrt(dt))
    return [
        Step(F, np.diag([(n * sqrt(rate) * DT) ** 2, k**2 * DT]))
        for n, k in zip(content[f"{q}_noise_std"], content[f"{q}_bias_std"], strict=True)
    ]


THREE_VALUES = (gtsam_python, gtsam_cpp, matlab, basalt)


# -- what is common -------------------------------------------------------------------------------


def propagated(step, noise):
    """After some steps, by doubling."""
    covariance, transition = np.zeros((2, 2)), step.transition
    left = n = round(STEPS * DT / step.dt)
    while left:
        if left & 1:
            covariance = transition @ covariance @ transition.T + noise
        noise = transition @ noise @ transition.T + noise
        transition, left = transition @ transition, left >> 1
    return covariance, n * step.dt


def assert_as_meant(step, n, k):
    """N^2 t, K^2 t and both together."""
    white, walk = step.noise * [[1.0, 0.0], [0.0, 0.0]], step.noise * [[0.0, 0.0], [0.0, 1.0]]
    alone, t = propagated(step, white)
    assert alone[0, 0] == pytest.approx(n**2 * t, rel=1e-5)
    alone, t = propagated(step, walk)
    assert alone[1, 1] == pytest.approx(k**2 * t, rel=1e-5)
    assert alone[0, 0] == pytest.approx(k**2 * t**3 / 3.0, rel=TOLERANCE)
    both, t = propagated(step, step.noise)
    assert both[0, 0] == pytest.approx(n**2 * t + k**2 * t**3 / 3.0, rel=TOLERANCE)


@pytest.mark.parametrize("q", ["gyro", "accel"])
@pytest.mark.parametrize("program", ONE_VALUE, ids=lambda f: f.__name__)
def test_one_value_for_three_axes(program, q):
    assert_as_meant(program(q), *LARGEST[q])


@pytest.mark.parametrize("q", ["gyro", "accel"])
@pytest.mark.parametrize("program", THREE_VALUES, ids=lambda f: f.__name__)
def test_a_value_for_each_axis(program, q):
    for step, n, k in zip(program(q), N[q], K[q], strict=True):
        assert_as_meant(step, n, k)


@pytest.mark.parametrize("q", ["gyro", "accel"])
def test_glim_has_white_noise_alone(q):
    content = json.loads(file_of("glim"))["sensors"]
    assert content.keys() == {"imu_acc_noise", "imu_gyro_noise"}
    # imu_integration.cpp: covariance = noise^2 of GTSAM
    noise = content[{"gyro": "imu_gyro_noise", "accel": "imu_acc_noise"}[q]]
    assert noise == pytest.approx(max(N[q]), rel=1e-5)


@pytest.mark.parametrize("q", ["gyro", "accel"])
def test_ros_has_the_variance_of_a_sample(q):
    content = yaml_of("ros-covariance")
    name = {"gyro": "angular_velocity", "accel": "linear_acceleration"}[q]
    matrix = np.reshape(content[f"{name}_covariance"], (3, 3))
    assert np.all(matrix == np.diag(np.diag(matrix)))
    t = STEPS * DT
    assert np.diag(matrix) * DT**2 * STEPS == pytest.approx(np.square(N[q]) * t, rel=1e-5)
    assert content["orientation_covariance"][0] == -1.0


# -- Gauss-Markov processes -----------------------------------------------------------------------


def simulated_bias(phi, q, start, n):
    """Variance of b[k+1] = phi b[k] + noise of variance q after n steps."""
    for _ in range(n):
        start = phi**2 * start + q
    return start


@pytest.mark.parametrize("q", ["gyro", "accel"])
def test_gazebo(q):
    root = ElementTree.fromstring(file_of("gazebo"))
    tag = {"gyro": "angular_velocity", "accel": "linear_acceleration"}[q]
    starts = numbers("N+GM")
    for i, axis in enumerate("xyz"):
        noise = root.find(f"{tag}/{axis}/noise")
        assert noise.attrib == {"type": "gaussian"}
        value = {each.tag: float(each.text) for each in noise}
        assert (value["stddev"] * DT) ** 2 * STEPS == pytest.approx(N[q][i] ** 2 * STEPS * DT)
        # GaussianNoiseModel.cc ApplyImpl: sigma_b_d, phi_d
        tau, s = value["dynamic_bias_correlation_time"], value["dynamic_bias_stddev"]
        drive = -s * s * tau / 2.0 * np.expm1(-2.0 * DT / tau)
        phi = exp(-DT / tau)
        n = round(10.0 * tau / DT)
        assert simulated_bias(phi, drive, 0.0, n) == pytest.approx(SIGMA[q][i] ** 2, rel=1e-4)
        assert phi ** (TAU[q][i] / DT) == pytest.approx(exp(-1.0), rel=1e-5)
        sd = starts[f"{q}_{axis}"].initial_sd
        assert value["bias_stddev"] == pytest.approx(sqrt(SIGMA[q][i] ** 2 + sd**2), rel=1e-5)


@pytest.mark.parametrize("q", ["gyro", "accel"])
def test_gnss_ins_sim(q):
    space = {"np": np}
    exec(file_of("gnss-ins-sim"), space)
    given = space["imu_err"]
    # imu_model.py: units
    if q == "gyro":
        white = given["gyro_arw"] * radians(1.0) / 60.0
        drift = given["gyro_b_stability"] * radians(1.0) / 3600.0
    else:
        white, drift = given["accel_vrw"] / 60.0, given["accel_b_stability"]
    # pathgen.py: white/sqrt(dt) n; bias_drift
    assert (white / sqrt(DT) * DT) ** 2 * STEPS == pytest.approx(np.square(N[q]) * STEPS * DT)
    for i in range(3):
        tau = given[f"{q}_b_corr"][i]
        a = 1.0 - 1.0 / RATE / tau
        b = drift[i] * np.sqrt(1.0 - np.exp(-2.0 / (RATE * tau)))
        variance = simulated_bias(a, b**2, 0.0, round(5.0 * tau / DT))
        assert variance == pytest.approx(SIGMA[q][i] ** 2, rel=1e-3)
        assert a ** (TAU[q][i] / DT) == pytest.approx(exp(-1.0), rel=1e-3)
    assert {"gyro_b", "accel_b"} <= given.keys()  # without which it takes its own defaults


@pytest.mark.parametrize("q", ["gyro", "accel"])
def test_kfgins(q):
    content = yaml_of("kfgins")
    noise = content["imunoise"]
    # kf_gins.cpp loadConfig: units
    tau = noise["corrtime"] * 3600.0
    if q == "gyro":
        white, unit = np.array(noise["arw"]) * radians(1.0) / 60.0, radians(1.0) / 3600.0
        sd, start = np.array(noise["gbstd"]) * unit, np.array(content["initbgstd"]) * unit
    else:
        white, unit = np.array(noise["vrw"]) / 60.0, 1e-5
        sd, start = np.array(noise["abstd"]) * unit, np.array(content["initbastd"]) * unit
    # gi_engine.cpp: Qc = 2/tau sd^2, F = -1/tau, Phi = 1 + F dt, Qd = (Phi Q Phi' + Q) dt/2
    for i in range(3):
        phi, density = 1.0 - DT / tau, 2.0 / tau * sd[i] ** 2
        drive = 0.5 * (phi**2 + 1.0) * density * DT
        variance = simulated_bias(phi, drive, 0.0, round(5.0 * tau / DT))
        assert variance == pytest.approx(sd[i] ** 2, rel=1e-3)
        # There is one tau: the numbers bound those of the axis at all frequencies.
        f = np.logspace(-6, 1, 200)
        held = white[i] ** 2 + gmwm.GaussMarkov(sd[i], tau).psd(f, DT)
        own = N[q][i] ** 2 + gmwm.GaussMarkov(SIGMA[q][i], TAU[q][i]).psd(f, DT)
        assert np.all(held >= own * (1.0 - 1e-5))
        assert np.min(held / own) < 1.0 + 1e-4
    initial = [numbers("N+GM")[f"{q}_{axis}"].initial_sd for axis in "xyz"]
    assert start == pytest.approx(np.hypot(sd, initial), rel=1e-5)
    # As tight as one tau for all allows.
    models = {name: each.model for name, each in numbers("N+GM").items()}
    least = gmwm.bound(models, "N+GM", tau="shared")
    assert tau == pytest.approx(least["gyro_x"].tau[0], rel=1e-5)


def test_pyins():
    pyins = pytest.importorskip("pyins.inertial_sensor")
    space = {}
    exec(file_of("pyins"), space)
    given = numbers("N+K")
    for q in ("gyro", "accel"):
        model = space[f"{q}_model"]
        assert isinstance(model, pyins.EstimationModel)
        # Every axis has a bias that walks: the program's own matrices.
        assert model.v**2 * STEPS * DT == pytest.approx(np.square(N[q]) * STEPS * DT, rel=1e-5)
        driven = model.G @ np.diag(model.q**2) @ model.G.T
        assert np.diag(driven) == pytest.approx(np.square(K[q]), rel=1e-5)
        for i, axis in enumerate("xyz"):
            # A start that is not known is not zero, or there would be no walk.
            sd = given[f"{q}_{axis}"].initial_sd or K[q][i] * sqrt(60.0)
            assert model.P[i, i] == pytest.approx(sd**2, rel=1e-5)


def test_gtsam_runs_it():
    gtsam = pytest.importorskip("gtsam")
    space = {}
    exec(file_of("gtsam"), space)
    pim = gtsam.PreintegratedCombinedMeasurements(space["params"])
    for _ in range(STEPS):
        pim.integrateMeasurement(np.zeros(3), np.zeros(3), DT)
    covariance, t = np.asarray(pim.preintMeasCov()), STEPS * DT
    for place, q in ((0, "gyro"), (6, "accel")):
        expected = np.square(N[q]) * t + np.square(K[q]) * t**3 / 3.0
        found = np.diag(covariance)[place : place + 3]
        assert found == pytest.approx(expected, rel=TOLERANCE)
    assert np.diag(covariance)[9:12] == pytest.approx(np.square(K["accel"]) * t, rel=1e-5)
    assert np.diag(covariance)[12:15] == pytest.approx(np.square(K["gyro"]) * t, rel=1e-5)


GTSAM_HEADER = """
#pragma once
#include <memory>
namespace gtsam {
struct Diagonal { double x, y, z; };
struct Vector3 {
  Vector3(double x, double y, double z) : x(x), y(y), z(z) {}
  Diagonal asDiagonal() const { return {x, y, z}; }
  double x, y, z;
};
struct Matrix3 {
  Matrix3& operator=(const Diagonal& d) { trace = d.x + d.y + d.z; return *this; }
  double trace = 0.0;
};
struct PreintegrationCombinedParams {
  Matrix3 accelerometerCovariance, gyroscopeCovariance, biasAccCovariance, biasOmegaCovariance;
  static std::shared_ptr<PreintegrationCombinedParams> MakeSharedU(double) {
    return std::make_shared<PreintegrationCombinedParams>();
  }
};
}
"""
"""The names that GTSAM's own header has for the file."""

USE = """#include "gtsam_imu.h"
int main() { return imuParams()->accelerometerCovariance.trace > 0.0 ? 0 : 1; }
"""

OTHER = """#include "gtsam_imu.h"
double other() { return imuParams()->gyroscopeCovariance.trace; }
"""


@pytest.mark.slow  # starts a compiler
@pytest.mark.skipif(shutil.which("g++") is None, reason="needs g++")
def test_the_header_of_gtsam_compiles(tmp_path):
    # In two files of a program: a function that is not inline would be there twice.
    own = tmp_path / "gtsam" / "navigation"
    own.mkdir(parents=True)
    (own / "CombinedImuFactor.h").write_text(GTSAM_HEADER)
    texts = {"gtsam_imu.h": file_of("gtsam-cpp"), "main.cpp": USE, "other.cpp": OTHER}
    for name, text in texts.items():
        (tmp_path / name).write_text(text)
    command = ["g++", "-std=c++17", "-Wall", "-Wextra", "-Werror", "-I.", "main.cpp", "other.cpp"]
    subprocess.run([*command, "-o", "run"], cwd=tmp_path, check=True, timeout=120)
    subprocess.run([tmp_path / "run"], check=True, timeout=60)


def test_every_program_is_tested_here():
    tested = {f.__name__ for f in ONE_VALUE} | {"gtsam", "gtsam-cpp", "matlab", "basalt"}
    tested |= {"glim", "ros-covariance", "gazebo", "gnss-ins-sim", "kfgins", "pyins"}
    assert set(TARGETS) - tested == {"state-space"}  # which has its own file
    assert set(FORMS) == {"state-space"}
