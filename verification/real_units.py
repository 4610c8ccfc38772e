# SPDX-License-Identifier: BSD-3-Clause
"""Writes docs/real-units.md: calibrations and headings of real units beside their certificates.

The recordings are not part of the repository. Give their folder:

    python -m verification.real_units FOLDER
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from allanite.experiments.alignment import AlignmentEstimate, align
from allanite.experiments.calibration import CalibrationEstimate, calibrate
from allanite.quantities.earth import DEG_H
from allanite.recording.records import ArrayColumn, Channel, Recording

Array = NDArray[np.float64]
PAGE = Path(__file__).parent.parent / "docs" / "real-units.md"
ACC, GYRO = (tuple(f"{sensor}_{axis}" for axis in "xyz") for sensor in ("acc", "gyro"))
DEG = math.pi / 180

HEAD = """# Real units

Calibrations and headings from published recordings, compared with the published certificates or coefficients. The
recordings are not part of the repository; `python -m verification.real_units FOLDER` writes this page. allanite detects
the positions at rest; no noise model is given, so the noise comes from the recordings.
Intervals are at 95 %.
"""


def unit(acc: Array, gyro: Array, rate: float, units: tuple[str, str]) -> Recording:
    """Three accelerometers and three gyros."""
    columns = [ArrayColumn(np.ascontiguousarray(s[:, k])) for s in (acc, gyro) for k in range(3)]
    channels = [Channel.of(n, u) for names, u in zip((ACC, GYRO), units, strict=True) for n in names]
    return Recording(channels=tuple(channels), columns=tuple(columns), rate=rate)


def table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    lines = [header, ["---"] * len(header), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines) + "\n"


def span(low: float, high: float) -> str:
    """An interval, to the digits that its width deserves."""
    digits = max(0, 1 - math.floor(math.log10(max(high - low, 1e-300))))
    return f"{low:.{digits}f} to {high:.{digits}f}"


def beside(found: CalibrationEstimate, published: dict[str, float]) -> str:
    """Parameters with their intervals beside published values."""
    rows = []
    for name, value in published.items():
        p = found[name]
        holds = "yes" if p.interval[0] <= value <= p.interval[1] else "no"
        rows.append(
            [name, f"{p.value:.6g}", span(*p.interval), f"{value:g}", f"{p.value - value:+.2g}", holds]
        )
    return table(["parameter", "ours", "95 % interval", "published", "difference", "interval holds it"], rows)


def facts(found: CalibrationEstimate) -> str:
    scatter = ", ".join(f"{s.what} {s.ratio:.2f}" for s in found.scatter)
    return f"{len(found.positions)} positions, {found.verdict}; scatter over the noise within a position: {scatter}.\n"


def of_axes(**kinds: Sequence[float]) -> dict[str, float]:
    """Values by parameter: accelerometer_scale=(x, y, z) and so on."""
    return {
        f"{kind.replace('_', '.', 1)}_{axis}": value
        for kind, values in kinds.items()
        for axis, value in zip("xyz", values, strict=True)
    }


def xsens(folder: Path) -> str:
    acc, gyro = (np.loadtxt(folder / f"imu_tk_xsens/xsens_{s}.mat")[:, 1:] for s in ("acc", "gyro"))
    found = calibrate(unit(acc, gyro, 100.0, ("LSB", "LSB")), gyro=GYRO, accelerometer=ACC, gravity=9.81744)
    text = beside(
        found,
        of_axes(
            accelerometer_scale=(415, 413, 415),
            accelerometer_bias=(33123, 33276, 32360),
            gyro_scale=(4778, 4758, 4766),
            gyro_bias=(32768, 32466, 32485),
        ),
    )
    follows = np.abs(found.calibration.errors("gyro").gravity_sensitivity).max() / 4770 * 9.81744 / DEG
    return f"""## Xsens MTi turned by hand, raw counts (Tedaldi, Pretto, Menegatti 2014)

{facts(found)}
{text}
* The certificate gives whole counts per m/s² and rad/s: its scale factors are known to 0.1 % at best, and it does not
  state the date or the gravity of the factory. All differ from ours by less than 0.3 %.
* The biases of the gyros follow gravity, by up to {follows:.2f} deg/s per g: fitted, since without it the gyros scatter
  four times more than their noise. The certificate has no such term, and its gyro offsets are from another day.
"""


def openaxes(folder: Path, name: str, diagonal: Array, upper: Array, bias: Sequence[float]) -> str:
    path = folder / "openaxes_d20/log_imu9_2022-06-22_22-13-55.csv"
    d = np.genfromtxt(path, delimiter=";", names=True, usecols=range(2, 17))
    acc, gyro = (np.stack([d[f"{n}_{k}"] for k in range(3)], 1) for n in (f"ACCEL_{name}", "GYRO"))
    record = unit(acc, gyro, 100.06, ("m/s²", "rad/s"))
    found, alike = calibrate(record, gravity=9.81744), calibrate(record, gravity=9.81744, drift=False)
    errors = alike.calibration.errors("accelerometer")
    ours = np.linalg.inv(errors.matrix)
    printed = np.diag(diagonal) + np.array([[0, upper[0], upper[1]], [0, 0, upper[2]], [0, 0, 0]])
    shift = ours @ errors.bias
    places = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)]
    rows = [
        [f"T[{i}, {j}]", f"{ours[i, j]:.5f}", f"{printed[i, j]:.5f}", f"{ours[i, j] - printed[i, j]:+.5f}"]
        for i, j in places
    ]
    rows += [
        [f"b {a} [m/s²]", f"{v:.4f}", f"{w:.4f}", f"{v - w:+.4f}"]
        for a, v, w in zip("xyz", shift, bias, strict=True)
    ]
    drift, default = found.scatter[0].walk, found.calibration.errors("accelerometer")
    moved = ", ".join(f"{b:.4f}" for b in np.linalg.inv(default.matrix) @ default.bias)
    sds = ", ".join(f"{found[f'accelerometer.bias_{a}'].sd:.4f}" for a in "xyz")
    return f"""### {name}

{facts(found)}
With equal weights for all positions and no drift of the biases, as in the authors' program:

{table(["x = T a - b", "ours", "printed", "difference"], rows)}
By default a drift of the biases is looked for: {drift:.2g} m/s² per root of a second here. With it the biases b are
{moved} m/s², with standard deviations of {sds}.
"""


def laser(folder: Path) -> str:
    with np.load(folder / "psins_lasergyro/lasergyro.npz") as file:
        record = unit(file["acc_m_s2"], file["gyro_deg_per_h"], float(file["fs"]), ("m/s^2", "deg/h"))
    found: AlignmentEstimate = align(
        record, latitude=34.246048 * DEG, height=380.0, axes="RFU", bias_repeatability=(0.01 * DEG_H, 1e-3)
    )
    arc, naive, latitude = found.interval, found.naive, found.latitude_interval
    assert naive is not None and latitude is not None and found.latitude_found is not None
    low, high = arc.start / DEG, (arc.start + arc.width) / DEG
    rows = [
        ["heading", f"{found.heading / DEG:.2f} deg", f"{span(low, high)} deg", "90.6 deg"],
        ["latitude from the axes", f"{found.latitude_found / DEG:.2f} deg",
         f"{span(latitude[0] / DEG, latitude[1] / DEG)} deg", "34.246 deg"],
        ["heading, mean of the first 300 s", f"{naive.heading / DEG:.1f} deg", "flagged: the unit moved", "90.6 deg"],
    ]  # fmt: skip
    return f"""## Ring-laser unit in a parked vehicle, people entering (PSINS)

Verdict: {found.verdict}; a bias of 0.01 deg/h is stated.

{table(["", "ours", "95 % interval", "reference"], rows)}"""


def main() -> None:
    """Write the page."""
    if len(sys.argv) != 2:
        raise SystemExit("usage: python -m verification.real_units FOLDER")
    folder = Path(sys.argv[1])
    adxl = openaxes(
        folder, "ADXL355", np.array([0.96276, 0.96732, 0.97079]), np.array([0.0015751, -0.00018891, 0.000859]),
        (0.064447, 0.011034, 0.034253),
    )  # fmt: skip
    bmi = openaxes(
        folder, "BMI160", np.array([0.95418, 0.96061, 0.9501]), np.array([0.0031573, 0.009235, 0.00049713]),
        (-0.033224, 0.080497, 0.01579),
    )  # fmt: skip
    parts = [
        HEAD, xsens(folder), "## OpenAXES unit in an icosahedron (Webering et al. 2022)\n", adxl, bmi, laser(folder)
    ]  # fmt: skip
    PAGE.write_text("\n".join(parts), encoding="utf-8")


if __name__ == "__main__":
    main()
