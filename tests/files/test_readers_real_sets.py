# SPDX-License-Identifier: BSD-3-Clause
"""Every real recording opens with `read`, given at most what its file does not hold, and says what is published of it.

`SETS` is the list: what each file needs, its rows, its rate, and a published number. A file of the folder that is in no
list fails the walk.
"""

from __future__ import annotations

from collections.abc import Callable
from fnmatch import fnmatch
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from allanite.errors import InputError
from allanite.files.readers import read
from allanite.recording.records import Recording

Check = Callable[[Recording], None]


def means(recording: Recording, names: Any, begin: float = 0.0, end: float | None = None) -> np.ndarray:
    """Means of channels between two times [s]."""
    part = recording.window(begin, end)
    return np.array([np.nanmean(part.values(n)) for n in names])


def level(
    value: float, names: Any, *, rel: float, scale: Any = 1.0, offset: Any = 0.0, **span: float
) -> Check:
    """The length of the mean vector, after offset and scale."""

    def check(recording: Recording) -> None:
        vector = (means(recording, names, **span) - offset) * scale
        assert np.linalg.norm(vector) == pytest.approx(value, rel=rel)

    return check


def mean(*values: float, names: Any, abs: float, **span: float) -> Check:  # noqa: A002
    def check(recording: Recording) -> None:
        assert means(recording, names, **span) == pytest.approx(values, abs=abs)

    return check


def sigma(value: float, *, frequency: float | None = None) -> Check:
    """The Allan deviation at one sample that Stable32 prints; of phase, or of frequency over its nominal value."""

    def check(recording: Recording) -> None:
        y = recording.values(recording.names[0]) / (frequency or 1.0)
        steps = np.diff(y) if frequency else np.diff(y, 2)
        assert np.sqrt(np.mean(steps**2) / 2) == pytest.approx(value, rel=1e-4)

    return check


def triad(recording: Recording) -> None:
    """T a - b of the repository, at g = 9.81744."""
    matrix = np.reshape([0.96276, 0, 0, 0.0015751, 0.96732, 0, -0.00018891, 0.000859, 0.97079], (3, 3)).T
    a = means(recording, [f"ACCEL_ADXL355_{k}" for k in range(3)], 0.0, 3.0)
    assert np.linalg.norm(matrix @ a - [0.064447, 0.011034, 0.034253]) == pytest.approx(9.81744, rel=2e-3)


def turntable(recording: Recording) -> None:
    """The Earth's rate, after scale, misalignment and bias that the file was made with."""
    arcsec, deg_h = np.radians(1 / 3600), np.radians(1 / 3600)
    errors = np.array([[0, 10, 20], [30, 0, 40], [50, 60, 0]]) * arcsec - np.diag([10, 20, 30]) * 1e-6
    w = means(recording, [f"angle_{a}" for a in "xyz"], 5.0, 60.0) * recording.rate
    true = np.linalg.solve(np.eye(3) + errors, w + np.array([0.1, 0.2, 0.3]) * deg_h)
    assert np.linalg.norm(true) / deg_h == pytest.approx(15.041067, abs=1e-3)


def dropouts(number: int) -> Check:
    def check(recording: Recording) -> None:
        assert recording.notes["source"]["dropouts"] == number

    return check


XYZ = {g: [f"{g}{a}" for a in "xyz"] for g in ("a", "g", "gyro_", "acc_", "mag_")}
CH = ["ch0", "ch1", "ch2"]
FIELDS = [*(f"angle_{a}" for a in "xyz"), *(f"velocity_{a}" for a in "xyz"), "t"]
FLOATS = {"frame": {"fields": [{"name": n, "type": "f32"} for n in FIELDS]}}
MPU = {
    "scale": np.array([6.020083e-4, 5.968449e-4, 5.859241e-4]),
    "offset": [711.5, -358.5, -1840.1],
}  # added there
PHIDGETS = (13_964, 249.974, level(9.87, XYZ["acc_"], rel=0.02, begin=0.0, end=1.0))

#: File -> (what it does not hold, rows, rate [Hz], a published number).
SETS: dict[str, tuple[dict[str, Any], int, float, Check | None]] = {
    "psins_lasergyro/lasergyro.imu": (
        {"rate": 100},
        184_718,
        100.0,
        level(14.815, CH, rel=1e-3, scale=10.0, begin=600.0, end=1840.0),
    ),
    "psins_lasergyro/lasergyro.npz": (
        {},
        184_718,
        100.0,
        level(14.815, XYZ["gyro_"], rel=1e-3, begin=600.0, end=1840.0),
    ),
    "imu_tk_xsens/xsens_acc.mat": (
        {},
        51_175,
        100.01,
        level(
            9.81744,
            CH,
            rel=2e-3,
            scale=1 / np.array([414.42, 412.03, 414.62]),
            offset=[33123.8, 33275.1, 32364.5],
            begin=0.0,
            end=50.0,
        ),
    ),
    "imu_tk_xsens/xsens_gyro.mat": (
        {},
        51_175,
        100.01,
        mean(32777.5, 32459.2, 32512.1, names=CH, abs=2.0, begin=0.0, end=50.0),
    ),
    "openaxes_d20/log_imu9_2022-06-22_22-13-55.csv": ({}, 23_725, 100.06, triad),
    "psins_sysclbt_simulated/imusysclbt.bin": ({"layout": FLOATS}, 98_200, 100.0, turntable),
    "psins_sysclbt_simulated/transfer_align_fog_mems.mat": ({}, 10_001, 100.0, None),
    "tomisuarez_mpu6050/example_data_calibration.csv": (
        {},
        10_245,
        100.0,
        mean(-427.46, 147.95, -80.72, names=XYZ["g"], abs=0.5, begin=0.0, end=36.0),
    ),
    "tomisuarez_mpu6050/example_data_tinit_calc.csv": ({}, 44_930, 100.0, None),
    "tomisuarez_mpu6050/imu_90_x_rot.csv": ({}, 9_987, 100.0, None),
    "tomisuarez_mpu6050/imu_static_test.csv": (
        {},
        9_986,
        100.0,
        level(9.81, XYZ["a"], rel=2e-3, **MPU),
    ),
    **{
        f"mikoff_mpu9150/imu{k}.log": ({"rate": 100}, rows, 100.0, None)
        for k, rows in enumerate((15_969, 15_931, 15_934, 15_967, 15_968))
    },
    "adis16405_calgary/adis_16405_imu4.npz": (
        {},
        1_000_000,
        100.0,
        mean(0.39083, -0.45366, -0.27119, names=XYZ["g"], abs=5e-6),
    ),
    "allantools_stable32/phasedat/PHASE.DAT": ({"rate": 1}, 1001, 1.0, sigma(0.29223)),
    "allantools_stable32/Cs5071A/5071A_phase.txt.gz": ({}, 556_990, 1.0, sigma(3.3171e-10)),
    "allantools_stable32/gps/gps_1pps_phase_data.txt.gz": ({"rate": 1}, 241_218, 1.0, sigma(6.1244e-09)),
    "allantools_stable32/ocxo/ocxo_frequency.txt": (
        {"rate": 1},
        19_982,
        1.0,
        sigma(7.6143e-11, frequency=1e7),
    ),
    "allantools_stable32/pink_frequency/pink_frequency.txt": (
        {"rate": 1},
        10_000,
        1.0,
        sigma(1.4064e-07, frequency=1.0),
    ),
    "allantools_stable32/Keysight53230A_ti_noise_floor/tic_phase.txt": ({}, 55_688, 1.0, sigma(1.7702e-11)),
    "allantools_stable32/gradev/y.dat": ({"rate": 1}, 1000, 1.0, None),
    "allantools_stable32/gradev/y_gap.dat": ({"rate": 1}, 1000, 1.0, None),
    "formats_ros/phidgets_imu_upside_down.bag": ({}, *PHIDGETS),
    "formats_ros/phidgets_ros2_sqlite3": ({}, *PHIDGETS),
    "formats_ros/phidgets_ros2_mcap": ({}, *PHIDGETS),
    "formats_px4_ardupilot/mcap_test_ulog.ulg": ({}, 1297, 199.7, dropouts(0)),
    "formats_px4_ardupilot/sample_appended_multiple.ulg": ({}, 2373, 246.96, dropouts(0)),
    "formats_px4_ardupilot/sample_log_small.ulg": ({}, 1298, 204.58, dropouts(1)),
    "formats_px4_ardupilot/sample.ulg": ({}, 17_070, 248.55, dropouts(4)),
    "formats_px4_ardupilot/ardupilot_test.BIN": ({}, 45, 50.0, mean(44.4, names=["temperature"], abs=0.1)),
    "formats_misc/raw1.tdms": ({}, 2000, 50_000.0, None),
    "formats_misc/big_endian.tdms": ({}, 3500, 1000.0, None),
    "formats_misc/Digital_Input.tdms": ({}, 20_000, 2000.0, None),
    "formats_misc/xio_fusion_sensor_data.csv": ({}, 13_514, 100.0, None),
}
#: Results and curves, which are no recordings: other tests read them for what they are.
NO_LOGS = (
    "*.md", "*/LICENSE", "imu_utils_curves/*", "tomisuarez_mpu6050/R_q_*.csv", "tomisuarez_mpu6050/params_*.csv",
    "tomisuarez_mpu6050/static_intervals.csv", "allantools_stable32/sp1065_expected.csv",
    "allantools_stable32/gradev/x.dat", "allantools_stable32/*/phase_dat_*.txt", "allantools_stable32/*/tic_?*dev.txt",
    "allantools_stable32/*/tic_tierms.txt", "allantools_stable32/*/*dev*.txt", "allantools_stable32/*/*DEV*.txt",
    "allantools_stable32/*/mtie_*.txt", "allantools_stable32/*/tierms_*.txt",
)  # fmt: skip
EXTRAS = {".ulg": "pyulog", ".tdms": "nptdms", ".bag": "rosbags", "": "rosbags"}


@pytest.mark.parametrize("name", SETS)
def test_real_set(real_data: Callable[[str], Path], name: str) -> None:
    options, rows, rate, check = SETS[name]
    path = real_data(name)
    if path.suffix in EXTRAS:
        pytest.importorskip(EXTRAS[path.suffix])
    recording = read(path, **options)
    assert recording.n_samples - recording.notes["timebase"]["missing"] == rows
    assert recording.rate == pytest.approx(rate, rel=1e-4)
    if check is not None:
        check(recording)
    if options.get("rate"):  # nothing was given that the file holds
        with pytest.raises(InputError, match="--rate"):
            read(path)


def test_real_files_are_all_in_the_list(real_data: Callable[[str], Path]) -> None:
    folder = real_data("")
    names = sorted(p.relative_to(folder).as_posix() for p in folder.rglob("*") if p.is_file())
    assert names
    for name in names:
        listed = name in SETS or name.rpartition("/")[0] in SETS
        assert listed != any(fnmatch(name, pattern) for pattern in NO_LOGS), name
