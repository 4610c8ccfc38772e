# SPDX-License-Identifier: BSD-3-Clause
"""Writes docs/real-recordings.md: our results for real recordings beside published or data-sheet values.

The recordings are not part of the repository. Give their folder:

    python -m verification.real_recordings FOLDER
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

import allanite as al

PAGE = Path(__file__).parent.parent / "docs" / "real-recordings.md"

HEAD = """# Real recordings

Results of allanite for published recordings, with the published or data-sheet values. The recordings are not part of
the repository; `python -m verification.real_recordings FOLDER` writes this page. Intervals are at 95 %; `<` is a 95 %
upper limit of a term that the record does not resolve.

Each record is characterized as by `allanite characterize FILE` without options, except for the units, which the file
of the ADIS16405 does not state.
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class Record:
    """One recording and what is known of it."""

    title: str
    file: str
    about: str
    units: dict[str, str] | None = None
    published: dict[tuple[str, str], str] = field(default_factory=dict)
    remarks: tuple[str, ...] = ()


RECORDS = (
    Record(
        title="ADIS16405, at rest for 2.78 h (University of Calgary)",
        file="adis16405_calgary/adis_16405_imu4.npz",
        about="100 Hz, 1 000 000 samples, six axes; gyro LSB 0.05 deg/s, accelerometer LSB 3.33 mg.",
        units={"gyro": "deg/s", "acc": "g"},
        published={
            **{
                (f"g{a}", "N"): "data sheet: 0.05 deg/s/√Hz = 3.0 deg/√h (2.0 deg/√h as angle random walk)"
                for a in "xyz"
            },
            **{
                (
                    f"g{a}",
                    "B",
                ): "data sheet: 0.007 deg/s = 25 deg/h (in-run stability, the minimum of the curve)"
                for a in "xyz"
            },
        },
        remarks=(
            (
                "The gyros' N lies between the two figures of the data sheet: the density is quoted over the sensor's "
                "band, the random walk from long averages."
            ),
            (
                "25 deg/h as the minimum of a curve is B = 25/0.664 = 38 deg/h, which the intervals of all three gyros "
                "include."
            ),
            (
                "The sensor's own filter bends the shortest lags of every axis, which are left out of the fit. A line "
                "at 0.535 Hz is named."
            ),
        ),
    ),
    Record(
        title="MPU-6050, at rest for 449 s",
        file="tomisuarez_mpu6050/example_data_tinit_calc.csv",
        about="100 Hz, 44 930 samples in counts without a unit: results stay in counts.",
        published={
            ("gx", "N"): "0.98 /√Hz",
            ("gy", "N"): "1.47 /√Hz",
            ("gz", "N"): "1.22 /√Hz",
            ("ax", "N"): "5.3 /√Hz",
            ("ay", "N"): "5.0 /√Hz",
            ("az", "N"): "7.5 /√Hz",
        },
        remarks=(
            "White noise agrees with the quick reading within its interval or within a few percent.",
            (
                "449 s do not reach the floor: B is an upper limit on every axis, where a tool that reads the minimum "
                "prints a number."
            ),
        ),
    ),
    Record(
        title="MPU-6050, at rest for 100 s",
        file="tomisuarez_mpu6050/imu_static_test.csv",
        about="The same unit on another day; 9986 samples.",
        remarks=("N agrees with the longer record; every limit is wider, as it must be.",),
    ),
    Record(
        title="Ring-laser unit on a parked vehicle, 30.8 min",
        file="psins_lasergyro/lasergyro.npz",
        about="100 Hz; steps of 10 deg/h per sample; people and engine disturb it.",
        remarks=(
            (
                "Nothing is published of its noise, and nothing should be: vehicle motion and dither dominate the "
                "curve, which the findings say. Where a term is printed it describes the parked vehicle, not the gyro."
            ),
        ),
    ),
    Record(
        title="Phidgets IMU, ROS 1 bag, 56 s",
        file="formats_ros/phidgets_imu_upside_down.bag",
        about="249.97 Hz by its stamps; 96 of 14 060 samples are missing and stay missing.",
        remarks=(
            "A sample of a format, handled by a person while recording: the disturbance is the first finding.",
        ),
    ),
)


def page(folder: Path) -> str:
    """The whole page."""
    parts = [HEAD]
    for record in RECORDS:
        study = al.characterize(al.read(folder / record.file, unit=record.units))
        parts.append(section(record, study))
    parts += [_fleet(folder), _in_motion(folder), _others()]
    return "\n".join(parts)


def section(record: Record, study: al.Study) -> str:
    """One recording's part."""
    lines = [f"## {record.title}", "", record.about, ""]
    lines += ["| channel | term | ours | published |", "|---|---|---|---|"]
    channels: Any = study.to_json()["channels"]
    for channel in channels:
        for name, ours in _rows(channel):
            lines.append(
                f"| {channel['name']} | {name} | {ours} | {record.published.get((channel['name'], name), '')} |"
            )
    lines += ["", *(f"* {r}" for r in record.remarks), "", "Findings:", ""]
    shown = [f for f in study.findings if f.severity.value != "info"]
    lines += [f"* {f.code}: {f.message}" for f in shown[:12]]
    if len(shown) > 12:
        lines.append(f"* and {len(shown) - 12} more")
    return "\n".join([*lines, ""])


def _rows(channel: dict[str, Any]) -> Iterable[tuple[str, str]]:
    if not channel["models"]:
        yield "-", "no model: see the findings"
        return
    model = channel["models"][0]
    names = {"N": "N", "B": "B", "B_equiv": "B", "T": "T_b", "K": "K"}
    for e in model["estimates"]:
        if e["symbol"] in names and (e["supported"] or e["symbol"] != "T"):
            yield names[e["symbol"]], _cell(channel, e)


def _cell(channel: dict[str, Any], e: dict[str, Any]) -> str:
    from allanite.quantities.display_units import display_unit

    unit, factor = display_unit(
        channel["kind"], "B" if e["symbol"] == "B_equiv" else e["symbol"], channel["unit"]
    )
    if not e["supported"]:
        return f"< {e['upper'] / factor:.3g} {unit}" if e["upper"] is not None else "not resolved"
    upper = "∞" if e["upper"] is None else f"{e['upper'] / factor:.3g}"
    return f"{e['value'] / factor:.3g} ({e['lower'] / factor:.3g} to {upper}) {unit}"


def _fleet(folder: Path) -> str:
    """All sets with samples of six axes, described as the units of one fleet whose lots are their types."""
    with TemporaryDirectory() as place:
        logs = Path(place, "logs")
        logs.mkdir()
        for name, (rate, axes) in _six_axes(folder).items():
            columns = {"time [s]": np.arange(len(axes)) / rate}
            columns |= {f"{n} [{u}]": axes[:, k] for k, (n, u) in enumerate(_AXES)}
            pq.write_table(pa.table(columns), logs / f"{name}.parquet")
        out = Path(place, "fleet")
        al.fleet(str(logs / "*.parquet"), pattern="{lot}_{unit}_*.parquet", out=out)
        population = al.describe_fleet(out)
    lines = ["| coefficient | logs | middle | between types | between units |", "|---|---|---|---|---|"]
    for c in population.coefficients:
        types = c.between_lots.shown() if c.between_lots else ""
        lines.append(f"| {c.symbol} of {c.channel} | {c.logs} | {c.middle} | {types} | {c.spread.shown()} |")
    turned = ", ".join(Path(name).stem for name in population.turned)
    return f"""## All of them as one fleet

The recordings at rest, and the first 20 s of five MPU-9150, with the type of a sensor as its lot, as
`allanite fleet run --pattern '{{lot}}_{{unit}}_*.parquet'` and `allanite fleet report` describe them.
{population.verdict.words.capitalize()} ({population.reason}).

* Left out, since the unit was turned: {turned}. Their files hold poses.
* Left out, since too few units resolve them: {len(population.left_out)} other coefficients.
* Sensors of different types have little in common; a standard deviation of 1 between types is a factor of e. One unit
  of a type says nothing of how units of that type differ, so the spread between units is an upper limit.

{chr(10).join(lines)}
"""


_AXES = [*((f"gyro_{a}", "rad/s") for a in "xyz"), *((f"acc_{a}", "m/s^2") for a in "xyz")]


def _six_axes(folder: Path) -> dict[str, tuple[float, NDArray[np.float64]]]:
    """Rate, and samples [rad/s, m/s^2], of each log."""
    deg, g = math.pi / 180, 9.80665
    with np.load(folder / "adis16405_calgary/adis_16405_imu4.npz") as file:
        logs = {"ADIS16405_1_a": (100.0, file["data"] * ([deg] * 3 + [g] * 3))}
    for k, name in enumerate(("example_data_tinit_calc", "imu_static_test")):
        counts = np.loadtxt(folder / f"tomisuarez_mpu6050/{name}.csv", delimiter=",", skiprows=5)
        logs[f"MPU6050_1_{'ab'[k]}"] = (
            100.0,
            np.hstack([counts[:, 3:] / 131 * deg, counts[:, :3] / 16384 * g]),
        )
    for k in range(5):
        axes = np.loadtxt(folder / f"mikoff_mpu9150/imu{k}.log")[:2000]
        logs[f"MPU9150_{k}_a"] = 100.0, np.hstack([axes[:, 3:], axes[:, :3]])
    bag = al.read(folder / "formats_ros/phidgets_imu_upside_down.bag")
    logs["Phidgets_1_a"] = 250.0, np.stack([bag.values(name) for name, _ in _AXES], axis=1)
    with np.load(folder / "psins_lasergyro/lasergyro.npz") as file:
        axes = np.hstack([file["gyro_deg_per_h"] * deg / 3600, file["acc_m_s2"]])
        logs["ringlaser_1_a"] = float(file["fs"]), axes
    return logs


def _in_motion(folder: Path) -> str:
    """Logs at rest beside logs of the same sensor in the hand."""
    mpu = folder / "tomisuarez_mpu6050"
    px4 = al.read(folder / "formats_px4_ardupilot" / "sample.ulg")
    rest = px4.window(9, 39)
    lines = [
        "| sensor | in motion | channel | N in motion over N at rest | verdict |",
        "|---|---|---|---|---|",
    ]
    for sensor, what, at_rest, moved in (
        ("PX4", "at rest, 39 to 68 s", rest, px4.window(39, 68)),
        ("PX4", "in the hand, up to 7 s", rest, px4.window(0, 7)),
        (
            "MPU-6050",
            "turned by 90°",
            al.read(mpu / "imu_static_test.csv"),
            al.read(mpu / "imu_90_x_rot.csv"),
        ),
    ):
        found = al.measure_in_motion(at_rest, [moved])
        lines += [
            f"| {sensor} | {what} | {c.name} | {c.inflation} | {c.verdict.words} |" for c in found.channels
        ]
    return f"""## Noise in motion

Two sensors, each compared with itself as by `allanite in-motion`: the flight controller of `sample.ulg`, at rest from 9
to 39 s, and the MPU-6050 of `imu_static_test.csv`. Every channel of the controller tells later rest from movement. The
ratio of the moved logs is that of movement, not of the sensor's noise; the MPU-6050 was turned in steps, so its
intervals are those of the scatter between parts of the log.

{chr(10).join(lines)}
"""


def _others() -> str:
    return """## Recordings that are not at rest

The pose and motion logs of the same collection (Xsens, OpenAXES, MPU-9150, x-io) are refused with the finding
`not_at_rest`: a noise model of a moving sensor would describe the hand that moved it. The clock data with results of
Stable32 are compared in `tests/noise/test_allan.py`: deviations agree to the printed digits (1e-4), bounds to 1e-3 with
the degrees of freedom of its own convention. The Allan curves of six IMUs printed by imu_utils are fitted without their
samples: our model at 1 s agrees with the printed density within 8 % for five of them; the sixth file holds the
deviation per sample under the same name, 14 times larger, which the comparison shows.
"""


def main() -> None:
    """Write the page."""
    PAGE.write_text(page(Path(sys.argv[1])), encoding="utf-8")


if __name__ == "__main__":
    main()
