# SPDX-License-Identifier: BSD-3-Clause
"""Refusals of Allan curves: those of other programs, and logs that are one."""

from __future__ import annotations

from pathlib import Path

import numpy as np

import allanite as al
from refusals import Refusal, numbers, table

__all__ = ["CURVES"]

SAMPLES = 20_000
LAGS = np.array([1, 2, 4, 8, 16, 32, 64, 128, 256, 512])
CURVE = al.allan_curve(
    al.Recording.from_rate(numbers(SAMPLES, 1), rate=100.0, unit="deg/s", names=["g"]), taus=LAGS / 100
)["g"]
TAU, DEV = LAGS / 100, np.degrees(CURVE.deviation[:, 0])
COUNTS = SAMPLES - 2 * LAGS + 1
KNOWN = "--samples 20000 --rate 100 --unit deg/s"


def saved(path: Path) -> None:
    curve = al.allan_curve(al.Recording.from_rate(numbers(2000, 1), rate=100.0, unit="deg/s", names=["g"]))
    curve.to_csv(path)


LOG = table("t [s],x [deg/s]", np.arange(250) / 100, y=numbers(250, 1))
PLAIN = table("tau [s],oadev [deg/s]", TAU, DEV)
CURVES = (
    Refusal(
        line="info 'a curve.csv'",
        files={"a curve.csv": table("averaging time [s],deviation", TAU, DEV)},
        says=("looks like an Allan curve, not a log",),
        adds={"N": "20000", "HZ": "100", "UNIT": "deg/s"},
    ),
    Refusal(
        line=f"fit 'a curve.csv' {KNOWN} --statistic oadev",
        files={"a curve.csv": PLAIN},
        says=("describe a curve from another program",),
        adds={"--samples": "20000 --curve", "--statistic": "oadev --curve"},
    ),
    Refusal(
        line=f"fit 'a curve.csv' --curve {KNOWN} --terms NB --method likelihood",
        files={"a curve.csv": PLAIN},
        says=("a curve is fitted by --method moments or slopes",),
        adds={"--method": "slopes", "--terms": "", "--lines": "", "--floor": "", "--accept": ""},
        instead=("--method", "--terms"),
    ),
    Refusal(
        line="fit 'a curve.csv' --rate 100 --unit deg/s",
        files={"a curve.csv": saved},
        says=("is a curve of allanite and contains this",),
        adds={"--rate": "", "--unit": ""},
        instead=("--rate", "--unit"),
    ),
    Refusal(
        line="fit 'a curve.csv' --from 10 --to 20",
        files={"a curve.csv": saved},
        says=("has no meaning for a curve",),
        adds={"--from": "", "--to": ""},
        instead=("--from", "--to"),
    ),
    Refusal(
        line="fit 'a curve.csv' --curve --method slopes --samples 20000 --rate 100",
        files={"a curve.csv": table("averaging time [s],,", TAU, DEV, DEV)},
        says=("have no headings, and any of them may be the deviation",),
        later={"--channels": "it is undetermined whether"},
    ),
    Refusal(
        line="fit 'a curve.csv' --curve --method slopes --samples 20000 --rate 100 --unit deg/s",
        files={"a curve.csv": table("averaging time [s],x", TAU, DEV)},
        says=("it is undetermined whether",),
    ),
    Refusal(
        line="fit 'a curve.csv' --curve --method slopes --samples 20000",
        files={"a curve.csv": PLAIN},
        says=("the sample rate of the record is not in the file",),
        adds={"--rate": "100"},
    ),
    Refusal(
        line="fit 'a curve.csv' --curve --method slopes --samples 20000",
        files={"a curve.csv": table("m,oadev [deg/s]", LAGS, DEV)},
        says=("the lags are in samples: pass the sample rate",),
        adds={"--rate": "100"},
    ),
    Refusal(
        line="fit 'a curve.csv' --curve --method slopes --rate 100",
        files={"a curve.csv": PLAIN},
        says=("the length of the record is unknown",),
        adds={"--samples": "20000"},
    ),
    Refusal(
        line="fit 'a curve.csv' --curve --method slopes --rate 100",
        files={"a curve.csv": table("tau [s],oadev [deg/s],count", TAU, DEV, np.round(COUNTS * LAGS**-0.3))},
        says=("the counts fit no record without gaps",),
        adds={"--samples": "20000"},
    ),
    Refusal(
        line="fit 'a curve.csv' --curve --method slopes --rate 100 --samples 30000",
        files={"a curve.csv": table("tau [s],oadev [deg/s],count", TAU, DEV, COUNTS)},
        says=("the counts imply",),
        adds={"--samples": ""},
    ),
    Refusal(
        line="fit 'a curve.csv' --curve --method slopes --rate 130 --samples 20000",
        files={"a curve.csv": PLAIN},
        says=("and must be a whole number: correct --rate",),
        adds={"--rate": "100"},
    ),
    Refusal(
        line="fit 'a curve.csv' --curve --method slopes --rate 100 --samples 900",
        files={"a curve.csv": PLAIN},
        says=("correct --samples or --rate",),
        adds={"--rate": "10", "--samples": "20000"},
        later={"--rate": "must be a whole number"},
    ),
    Refusal(
        line="fit 'a curve.csv' --curve --method slopes --rate 100 --samples 20000",
        files={
            "a curve.csv": table(
                "tau [s],oadev x [deg/s],oadev y [deg/s]", TAU, DEV, np.where(LAGS == 8, -1, DEV)
            )
        },
        says=("choose the columns with --channels",),
        adds={"--channels": "'oadev x [deg/s]'"},
    ),
    Refusal(
        line="fit 'a curve.csv' --curve --method slopes --rate 100 --samples 20000 --unit deg/s",
        files={"a curve.csv": table("tau [s],gyro oadev,acc oadev", TAU, DEV, DEV)},
        says=("cannot be that of gyros and accelerometers",),
    ),
    Refusal(
        line="fit 'a log.csv' --terms NB",
        files={"a log.csv": LOG},
        says=("takes no terms: use --method",),
        adds={"--method": "likelihood"},
    ),
    Refusal(
        line="fit 'a log.csv' --lines 3",
        files={"a log.csv": LOG},
        says=("takes no lines: use --method",),
        adds={"--method": "likelihood"},
    ),
    Refusal(
        line="fit 'a log.csv' --floor 'a floor.csv' --method slopes",
        files={"a log.csv": LOG, "a floor.csv": LOG},
        says=("goes with the log of the sensor and",),
        adds={"--floor": ""},
    ),
    Refusal(
        line="allan 'a log.csv' --kind phase --statistic mtie -o 'out.csv'",
        files={"a log.csv": table("t [s],x [ns]", np.arange(600) / 100, y=numbers(600, 1))},
        says=("take deviations",),
        adds={"--floor": "", "--plot": ""},
        instead=("-o",),
    ),
)
