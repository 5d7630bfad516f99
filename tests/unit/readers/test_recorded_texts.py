# ruff: noqa: E501 - tables of texts
"""Texts of all sorts, and what each is read as: channels, units, rate, notices, or the message."""

import gzip

import numpy as np

from gmwm.readers.cells import FIELD_OF_DATE, date_columns, number, seconds_of, split_header
from gmwm.readers.names import meaning
from recorded import assert_as_recorded, reading, refused

N = 80
NAMES = "time_s,gyro_x,gyro_y,gyro_z,accel_x,accel_y,accel_z"
SI = {"gyro": "rad/s", "accel": "m/s^2"}
RNG = np.random.default_rng(3)
ROWS = np.round(RNG.normal(size=(N, 6)) * 1e-2 + [0.01, 0.02, -0.01, 0.1, -0.2, 9.8], 5)
TIME = 0.01 * np.arange(N)


def text(header=NAMES, rows=ROWS, time=TIME, mark=",", end="\n", before="", form="{:.6g}", last=""):
    columns = rows if time is None else np.column_stack([time, rows])
    lines = [mark.join(map(form.format, row)) + last for row in columns.tolist()]
    return before + end.join([*([header] if header else []), *lines]) + end


def changed(lines, source=None):
    """Some lines of a text in another's place, by number."""
    found = (source or text()).splitlines()
    for line, new in lines.items():
        found[line - 1] = new
    return "\n".join([line for line in found if line is not None]) + "\n"


def one(k, column, cell):
    """One field replaced."""
    cells = text().splitlines()[k].split(",")
    cells[column] = cell
    return changed({k + 1: ",".join(cells)})


def dated(form, step=10, zone=""):
    times = np.datetime64("2024-03-05T10:59:58.500") + np.arange(N) * np.timedelta64(step, "ms")
    stamps = [form(str(each)) + zone for each in times]
    lines = [
        f"{s},{','.join(f'{v:.6g}' for v in row)}" for s, row in zip(stamps, ROWS, strict=True)
    ]
    return "\n".join([NAMES.replace("time_s", "date"), *lines, ""])


UNITS = (
    "t [ms],wx [deg/s],wy [deg/s],wz [deg/s],ax [g],ay [g],az [g]",
    "timestamp_us,gyro_x_dps,gyro_y_dps,gyro_z_dps,acc_x_mg,acc_y_mg,acc_z_mg",
)
MORE = NAMES + ",temp [degC],vbat,clock time [s],note"
WIDE = np.column_stack([ROWS, 20.0 + TIME, 3.3 + 0 * TIME, 5.0 + TIME, ROWS[:, 0]])

TEXTS = {
    "plain": (text(), {"units": SI}),
    "no units": (text(), {}),
    "channel units": (text(), {"units": {**SI, "gyro_y": "deg/s", "accel_x": "g"}}),
    "wrong unit": (text(), {"units": {**SI, "gyro_y": "g"}}),
    "header units": (text(UNITS[0], time=10 * np.arange(N)), {}),
    "word units": (text(UNITS[1], ROWS * [1, 1, 1, 100, 100, 100], 1e4 * np.arange(N), form="{:.9g}"), {}),
    "contradicted": (text(UNITS[0], time=10 * np.arange(N)), {"units": SI}),
    "commas": (text(NAMES.replace(",", ";"), mark=";").replace(".", ","), {"units": SI}),
    "no header": (text(None), {"units": SI}),
    "six": (text(None, time=None), {"units": SI, "rate": 100.0}),
    "six without rate": (text(None, time=None), {"units": SI}),
    "one column": (text(None, ROWS[:, :1], None), {"units": {"accel": "g"}, "rate": 50}),
    "more": (text(MORE, WIDE), {"units": SI}),
    "twice": (text(NAMES.replace("gyro_y", "gyro_x")), {"units": SI}),
    "by name": (text(), {"units": SI, "channels": {"gyro_x": "GYRO_Z", "accel_y": "accel_y"}}),
    "some": (text(), {"units": SI, "channels": ["gyro", "accel_z"]}),
    "unknown": (text(), {"units": SI, "channels": ["gyro", "mag_x"]}),
    "no column": (text(), {"units": SI, "channels": {"gyro_x": "foo"}}),
    "beyond": (text(), {"units": SI, "channels": {"gyro_x": 7}}),
    "below": (text(), {"units": SI, "channels": {"gyro_x": -1}}),
    "auxiliary": (text(MORE, WIDE), {"units": SI, "channels": {"gyro_x": 1, "T": "temp"}}),
    "used twice": (text(), {"units": SI, "channels": {"gyro_x": 1, "gyro_y": 1}}),
    "time is channel": (text(), {"units": SI, "channels": {"gyro_x": 0}, "time": 0}),
    "time false": (text(), {"units": SI, "time": False, "rate": 20}),
    "time index": (text(MORE, WIDE), {"units": SI, "time": 9}),
    "time missing": (text(), {"units": SI, "time": "t"}),
    "rate agrees": (text(), {"units": SI, "rate": 100.9}),
    "rate contradicts": (text(), {"units": SI, "rate": 101.1}),
    "unknown time unit": (text(NAMES.replace("time_s", "time [foo]")), {"units": SI}),
    "known by rate": (text(NAMES.replace("time_s", "time [foo]")), {"units": SI, "rate": 70}),
    "bare ms": (text(NAMES.replace("time_s", "time"), time=10 * np.arange(N)), {"units": SI}),
    "bare s": (text(NAMES.replace("time_s", "time")), {"units": SI}),
    "bare us rate": (text(NAMES.replace("time_s", "time"), time=10_000 * np.arange(N)), {"units": SI, "rate": 100}),
    "bare nothing": (text(NAMES.replace("time_s", "time"), time=1e20 * np.arange(N)), {"units": SI}),
    "bare and no units": (text(NAMES.replace("time_s", "time"), time=10 * np.arange(N)), {}),
    "64": ("\n".join(text().splitlines()[:65]) + "\n", {"units": SI}),
    "mostly missing": (text(rows=np.where(np.arange(N)[:, None] < 20, np.nan, ROWS)), {"units": SI}),
    "missing": (one(20, 2, ""), {"units": SI}),
    "no stamp": (one(20, 0, ""), {"units": SI}),
    "word": (one(20, 2, "abc"), {"units": SI}),
    "infinite": (one(20, 2, "inf"), {"units": SI}),
    "two infinite": (changed({9: "0.07,inf,1,1,1,1,1", 8: "0.06,1,1,1,1,1,1e999"}), {"units": SI}),
    "plus": (one(20, 2, "+1.5"), {"units": SI}),
    "few fields": (changed({9: "0.07,1,2"}), {"units": SI}),
    "many fields": (changed({9: "0.07,1,2,3,4,5,6,7"}), {"units": SI}),
    "open quote": (changed({9: '0.07,"1,2,3,4,5,6'}), {"units": SI}),
    "error codes": (changed({9: "0.07,-9999,1,1,1,1,1", 30: "0.28,999,1,1,1,1,1"}), {"units": SI}),
    "overflows": (changed({9: "0.07,1,1,1,1,1,32767", 30: "0.28,1,1,1,1,-2147483648,1"}), {"units": SI}),
    "beyond sensors": (changed({9: "0.07,1e9,-2e9,1,1,1,1"}), {"units": SI}),
    "many codes": (text(rows=np.where(np.arange(N)[:, None] % 8 == 1, -999, ROWS)), {"units": SI}),
    "isolated": (text(rows=np.where(np.arange(N)[:, None] % 20 == 1, 77.5, ROWS)), {"units": SI}),
    "transitions": (text(rows=np.where(np.arange(N)[:, None] % 20 < 4, 77.5 * (np.arange(N)[:, None] % 4), ROWS)), {"units": SI}),
    "cut": (text()[:-20], {"units": SI}),
    "cut field": (text(form="{:.6f}")[:-3], {"units": SI}),
    "cut taken": (text(form="{:.6f}")[:-3], {"units": SI, "damaged": True}),
    "slower": (text(None, time=None), {"units": SI, "rate": 1e-310}),
    "stamps twice": (text(time=0.01 * np.repeat(np.arange(N), [2 if k in (9, 30) else 1 for k in range(N)])[:N]), {"units": SI}),
    "rows twice": (changed({12: text().splitlines()[10], 40: text().splitlines()[38]}), {"units": SI}),
    "several sensors": (text(NAMES + ",imu_id", np.column_stack([ROWS, np.arange(N) % 3])), {"units": SI}),
    "one sensor": (text(NAMES + ",imu_id", np.column_stack([ROWS, np.arange(N) // 50])), {"units": SI}),
    "dates": (dated(str), {"units": SI}),
    "dates with zone": (dated(str, zone="+02:00"), {"units": SI}),
    "zone changes": (dated(str, zone="Z").replace("10:59:58.700Z", "10:59:58.700"), {"units": SI}),
    "no date": (dated(str).replace("10:59:58.700", "10:59:61.7"), {"units": SI}),
    "slashes": (dated(lambda s: s.replace("-", "/")), {"units": SI}),
    "times of day": (text(NAMES.replace("time_s", "time"), time=np.round(105959.5 + TIME + np.where(TIME > 0.495, 4040, 0), 3), form="{:.9g}"), {"units": SI}),
    "binary": ("\x00\x01\x02" * 50, {"units": SI}),
    "empty": ("", {"units": SI}),
    "words": ("a b c\nd e f\n", {"units": SI}),
    "blackbox": ('"acc_1G",2048\n' + text("loopIteration,time (us),gyroADC[0],gyroADC[1],gyroADC[2],accSmooth[0],accSmooth[1],accSmooth[2]", np.column_stack([1e4 * np.arange(N), 50 * ROWS[:, :3], np.round(208.8 * ROWS[:, 3:])]), np.arange(N), form="{:.9g}"), {}),
    "blackbox plain": (text("loopIteration,time,gyroADC[0],gyroADC[1],gyroADC[2],accSmooth[0],accSmooth[1],accSmooth[2]", np.column_stack([1e4 * np.arange(N), ROWS]), np.arange(N), form="{:.9g}"), {"units": {"accel": "m/s^2"}}),
    "gyroflow": ("GYROFLOW IMU LOG\nversion,1.1\ntscale,0.001\ngscale,0.5\nascale,0.1\n" + text("t,gx,gy,gz,ax,ay,az", time=10 * np.arange(N)), {}),
    "dot": ("DeviceTag,Xsens DOT\n" + text("SampleTimeFine,Gyr_X,Gyr_Y,Gyr_Z,Acc_X,Acc_Y,Acc_Z", time=16_667 * np.arange(N), form="{:.9g}"), {"units": SI}),
    "mti": (text("SampleTimeFine,Gyr_X,Gyr_Y,Gyr_Z,Acc_X,Acc_Y,Acc_Z", time=100 * np.arange(N)), {"units": SI}),
    "kalibr": (text("timestamp,omega_x,omega_y,omega_z,alpha_x,alpha_y,alpha_z", time=1e7 * np.arange(N), form="{:.12g}"), {}),
    "px4": (text("timestamp,gyro_rad[0],gyro_rad[1],gyro_rad[2],accelerometer_m_s2[0],accelerometer_m_s2[1],accelerometer_m_s2[2]", time=1e4 * np.arange(N), form="{:.12g}"), {}),
    "rostopic": (text("time,field.header.stamp,field.angular_velocity.x,field.angular_velocity.y,field.angular_velocity.z", np.column_stack([1e7 * np.arange(N), ROWS[:, :3]]), 1e7 * np.arange(N) + 5, form="{:.12g}"), {"units": SI}),
    "shimmer": (text("Shimmer_1_Timestamp_CAL\tShimmer_1_Gyro_X_CAL\tShimmer_1_Accel_LN_X_CAL\tShimmer_1_Accel_WR_X_CAL\nms\tdeg/s\tm/(s^2)\tm/(s^2)", ROWS[:, 3:], 10 * np.arange(N), mark="\t"), {}),
    "shimmer word": (text("Shimmer_1_Timestamp_CAL\tShimmer_1_Gyro_X_CAL\nms\tdeg/s", ROWS[:, 3:4], 10 * np.arange(N), mark="\t").replace("\t0.1", "\tx", 1), {}),
    "gnss logger": (text("# UncalGyro,utc,elapsed"), {}),
}  # fmt: skip


def test_texts(tmp_path):
    found = {}
    for name, (content, options) in TEXTS.items():
        path = tmp_path / "log.csv"
        path.write_bytes(content.encode())
        found[name] = reading(path, **options)
    path = tmp_path / "Accelerometer.csv.gz"
    named = text("time,seconds_elapsed,z,y,x", np.column_stack([TIME, ROWS[:, 3:]]), 1e7 * np.arange(N),
                 form="{:.12g}")  # fmt: skip
    packed = gzip.compress(named.encode(), 0, mtime=0)
    path.write_bytes(packed)
    found["sensor logger"] = reading(path)
    path.write_bytes(packed[:-400])
    found["cut off"] = [reading(path), reading(path, damaged=True)]
    path.write_bytes(packed[:20])
    found["nothing left"] = [reading(path), reading(path, damaged=True)]
    assert_as_recorded("readers/texts", found)


WORDS = ["gyro_x", "gyroX", "GyroX", "gx", "wx", "omega_x", "angular_velocity.x", "AngularVelocity.y", "imu.gyro.z", "gyro[0]", "gyr_x[1]", "ax", "a_x", "fx", "acc_y", "accelX", "accelerometer_z", "linear_acceleration.x", "specific_force_z", "xgyro", "xacc", "ygyro", "imu_xgyro", "x_gyro", "zmag", "gyro_bias_x", "acc_std_x", "gyro_temp_x", "rate_x", "rate_z", "turnrate_y", "g_x", "Gyro_X_dps", "gyro_x_rad_s", "gyro_x_deg_per_s", "acc_x_mss", "acc_x_m_s_2", "acc_x_g", "acc_x_mg", "acc_x_ug", "acc_z_mps2", "gyro_x_dph", "gyro_x_deg_h", "gyro_y_mdps", "time", "t", "ts", "time_s", "t_ms", "timestamp_us", "timestamp_ns", "timestampns", "time_stamp", "stamp", "sample_time", "sampleTimeFine", "header.stamp", "gps_time", "utc_time", "time_of_week", "elapsed_time", "seconds", "s", "second", "ms", "us", "millis", "time_minutes", "time_hours", "days", "t_min", "system_time_us", "boot_time_ms", "field.header.stamp", "temp", "temperature", "temp_c", "temp_degC", "imu_temp1", "T", "vbat", "voltage", "vdd", "battery_v", "temp_offset", "temp_valid", "time_temp", "temp_k", "wrss_x", "arss_x", "free_acc_x", "delta_v_x", "gyro_out_x", "gyro_x_out", "accel_xout", "xa", "ya", "gyro_w", "a", "f", "g", "w", "x", "y", "z", "acc_norm", "accel_0", "gyro_cov_x", "ref_gyro_x", "imu0_gyro_x", "linacc_x", "rotationRate.beta", "rps_x", "gyro_x_rps", "gyro_x_radps", "gyro_rad[0]", "gyro_rad_s[2]", "acc_m_s2[1]", "time_fine"]  # fmt: skip
BRACKETED = (
    "gyro_x [deg/s]", "gyro_x (deg/s)", "gyro x [°/s]", "gyro_x[rad s^-1]", "wx [rad/sec]", "ax [m/s²]",
    "ax [m/s2]", "ax [m s-2]", "ax [G]", "ax [mg]", "ax [m/s/s]", "ax [kg]", "ax [foo]", "gyro_x_dps [g]",
    "time [ms]", "time [min]", "time [h]", "time [days]", "time [foo]", "t [s]", "t [degC]", "T [degC]",
    "T [K]", "temp [C]", "temp [°C]", "vbat [V]", "vbat [mV]", "U [V]", "second [g]", "time (UTC)",
    "sample time [us]", "gyro_x [" + "deg/s " * 9 + "]", "x [deg/s]", "acc_x [m/s^2] ", "[deg/s]", "",
    "time_ms [s]", "current [A]", "temp status", "t temp", "time of temp", "Clock [ms]", "wx [μrad/s]",
    "gyro_x [deg*s^-1]", "ax [m/s^4]", "ax [m·s^-2]", "acc_x [g^1]", "gyro_x [1/s]",
)  # fmt: skip


def test_names():
    found = {}
    for name in (*WORDS, *BRACKETED):
        said = meaning(name)
        one = " ".join(str(each) for each in (said.role, said.unit, said.seconds, said.stated))
        found.setdefault(one.rstrip(), []).append(name)
    assert_as_recorded("readers/names", found)


def test_fields():
    found = {}
    cells = (
        "1", "-1.5", "+1.5", "1.", ".5", "1e5", "1E-5", "1e", "1_0", "٣", "nan", "-NaN", "NA", "n/a", "",
        "#N/A", "null", "inf", "-Infinity", "1e308", "1e151", "1e149", "0x1", "1,5", ",5", "1.5,", "--1",
    )  # fmt: skip
    for mark in ".,":
        found[f"numbers {mark}"] = {cell: str(number(cell, mark)) for cell in cells}
    dates = (
        "2024-03-05T10:59:58", "2024-03-05 10:59:58.25", "2024/3/5 1:59:58,5", "20240305T105958",
        "2024-065T10:59:58", "2024-366T10:59:58", "2023-366T10:59:58", "2024-W10-2T10:59:58",
        "2024W102T105958.5", "2024065T105958", "2024-03-05T10:59:58Z", "2024-03-05T10:59:58 UTC",
        "2024-03-05T10:59:58+01:30", "2024-03-05T10:59:58-0130", "2024-03-05T10:59:58+01",
        "2024-03-05T10:59:58+14:00", "2024-03-05T10:59:58+14:01", "2024-03-05T10:59:58+01:60",
        "2024-12-31T23:59:60Z", "2024-12-31T23:59:60.5", "2024-12-31T23:59:61Z", "2024-12-31T12:59:60",
        "2024-12-31T12:59:60Z", "2024-12-31T23:58:60Z", "2024-02-30T00:00:00", "2024-13-01T00:00:00",
        "2024-03-05T24:00:00", "2024-03-05T10:60:00", "2024-03-05", "10:59:58",
        "2024-12-31T22:59:60-01:00", "2024-03-05T10:59:59.999",
    )  # fmt: skip
    for date in dates:
        match = FIELD_OF_DATE.fullmatch(date)
        said = refused(lambda m=match: m and repr(seconds_of(m)))
        found[date] = said[0].split(":")[0] if isinstance(said, list) else said
    plain, zoned = "2024-03-05T10:59:58", "2024-03-05T10:59:58Z"
    for rows in (
        [[plain, "1", zoned]], [[plain, "1"], ["", "2"]], [[plain, zoned], [plain, plain]], [[""]],
        [[plain, zoned], [plain]], [],
    ):  # fmt: skip
        found[str(rows)] = date_columns(rows)
    found["headers"] = [
        split_header('wx [rad s^-1] "b c" d(e f)  g', " "),
        split_header('a, "b,c"', ","),
    ]
    assert_as_recorded("readers/fields", found)
