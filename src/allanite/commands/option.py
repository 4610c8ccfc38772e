# SPDX-License-Identifier: BSD-3-Clause
"""An option of a command, said once: the command line, the page and its lines of Python are made from it."""

from __future__ import annotations

from typing import Any, Literal

from allanite.lazy_dataclasses import dataclass

__all__ = [
    "ACCEPT",
    "BENCH",
    "BENCH_FILE",
    "BETWEEN",
    "CONFIDENCE",
    "DEAD_TIME",
    "FLOOR",
    "LATITUDE",
    "MEANS",
    "MODEL",
    "MODEL_CHANNELS",
    "READING",
    "RESTS",
    "SETUP",
    "STATISTICS",
    "TEMPERATURE",
    "TURNS",
    "WARM_UP",
    "Option",
    "OptionType",
    "option",
]

OptionType = Literal[
    "number", "integer", "share", "text", "flag", "choice", "names", "texts", "findings", "by-channel", "seconds",
    "seconds-list", "degrees", "latitude", "turns", "deg/s", "deg/h", "deg/h/g", "spans", "headings", "lines", "model",
    "recording", "log", "study", "document", "attached", "description", "file", "renamed", "acceleration", "goal",
    "goals", "initial", "models", "numbers", "place",
]  # fmt: skip

STATISTICS = (
    "oadev", "adev", "mdev", "tdev", "hdev", "ohdev", "totdev", "haar", "robust", "theo1", "theobr", "theoh",
)  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class Option:
    """One option.

    Attributes
    ----------
    type : str
        What its value is; times are seconds, angles degrees.
    flag : str
        As the command line has it; "" for one that is no word of the command.
    python : str
        As the function has it, and the page.
    help : str
    detail : str
        What the command line adds to it: how its word looks.
    required : bool
    choices : tuple of str
        Those of a choice; of any other type what the page offers, while the command line takes more.
    inside : str
        Name of the mapping of the function that holds it; "" where it is an argument itself.
    default
        None where there is none.
    otherwise : str
        What is done where it is not given, in place of a default.
    metavar : str
        What the help of the command line calls the value; "" for the name of its type.
    per_log : bool
        The command line takes a value for each of several logs as well.
    on_page : bool
        The page, which works on one log, has it as well.
    """

    type: OptionType
    flag: str
    python: str
    help: str
    detail: str = ""
    required: bool = False
    choices: tuple[str, ...] = ()
    inside: str = ""
    default: Any = None
    otherwise: str = ""
    metavar: str = ""
    per_log: bool = False
    on_page: bool = True


def option(type_: OptionType, flag: str, help_: str, **more: Any) -> Option:
    """An option whose argument has its name."""
    return Option(
        **{"type": type_, "flag": flag, "python": flag.strip("-").replace("-", "_"), "help": help_, **more}
    )


MODEL = option(
    "model", "--model", "Noise model of the sensor at rest: a study, output of `fit --json`, or text as for "
    "`simulate`.", metavar="MODEL",
)  # fmt: skip
ACCEPT = option("findings", "--accept", "Continue despite this finding.", metavar="FINDING")
FLOOR = option(
    "recording", "--floor", "Log of the instrument with its input shorted.", detail="its noise is subtracted",
    metavar="LOG",
)  # fmt: skip
TEMPERATURE = option(
    "by-channel", "--temperature", "Remove the effect of this temperature column.",
    detail="temp, or gyro_x=t1,gyro_y=t2", metavar="COLUMN",
)  # fmt: skip
WARM_UP = option("choice", "--warm-up", "Model or cut a warm-up that is detected.", choices=("model", "cut"))
CONFIDENCE = option("number", "--confidence", "Confidence level of the intervals.", default=0.95)

LATITUDE = option(
    "latitude", "--latitude", "Latitude in degrees, south negative.", detail="-23.31 or 23.31S", required=True,
    metavar="DEG",
)  # fmt: skip
DEAD_TIME = option("seconds", "--dead-time", "Time to skip after each turn.", default=2.0)
TURNS = (
    option(
        "choice", "--first", "Direction of the axis before the first turn.", detail="one axis cannot tell",
        choices=("north", "south", "up", "down"),
    ),
    option("turns", "--turns", "CSV of turns.", detail="start,stop in seconds"),
    option("seconds", "--dwell", "Time between turns, if the signal does not show them.", detail="30"),
    DEAD_TIME,
)  # fmt: skip
"""When one axis was turned, and where it pointed."""
SETUP = (
    option("share", "--scale-uncertainty", "Uncertainty of the scale factor.", detail="0.1%"),
    option("degrees", "--latitude-uncertainty", "Uncertainty of the latitude.", detail="0.01deg"),
    option("degrees", "--tilt", "Tilt of the table axis or of a vertical axis.", detail="0.1deg"),
    option("degrees", "--heading-uncertainty", "Uncertainty of the axis heading.", detail="3deg"),
)
"""Facts about the setup that only the user knows; `allanite.quantities.setup_uncertainty` has it."""
MODEL_CHANNELS = option(
    "renamed", "--model-channels", "Channel names in LOG = names in --model, if they differ.",
    detail="wx=gyro_x,wy=gyro_y", metavar="NAMES", on_page=False,
)  # fmt: skip
BETWEEN = option(
    "seconds", "--between", "Time between the LOGs of --positions or the rows of --means, if they carry no time.",
    default=60.0, on_page=False,
)  # fmt: skip
MEANS = (
    option("flag", "--means", "LOG is a table of mean readings, one row per position.", on_page=False),
    option(
        "seconds", "--averaging", "Averaging time of each row of --means, if no column gives it.", detail="60s",
        on_page=False,
    ),
    option(
        "choice", "--sd-of", "Meaning of the standard deviations in the --means table.",
        choices=("readings", "means"), on_page=False,
    ),
)  # fmt: skip
"""A table of means in place of a log."""

RESTS = (
    option("names", "--gyro", "Gyro channels x, y, z, if the units do not identify them.", metavar="NAMES"),
    option("names", "--accelerometer", "Accelerometer channels x, y, z, if the units do not identify them.",
        metavar="NAMES"),
    option("file", "--spans", "CSV of the rests: start,stop in seconds.", otherwise="found"),
)  # fmt: skip
"""Which channels are the axes of a unit, and where it rested."""

READING: tuple[Option, ...] = (
    option(
        "by-channel", "--unit", "Unit of the samples: deg/s, or gyro=deg/s,acc=g. With several logs: "
        "a.csv=g,b.csv=m/s², b.csv:acc=g.",
    ),
    option(
        "text", "--time", "Time column by name or number: t:ms, 'cnt:1/1000 s', Date:dmy, none.",
        metavar="COLUMN[:UNIT]", per_log=True,
    ),
    option("number", "--rate", "Sample rate in Hz, for a log without time stamps.", per_log=True),
    option("by-channel", "--scale-factor", "Scale factor of a sensor read in volts or counts: '24 mV/(deg/s)'."),
    option(
        "choice", "--sampling", "Samples are means over their interval, or values at an instant.",
        choices=("mean", "point"), default="mean",
    ),
    option("names", "--channels", "Channels or groups to use: gyro or gyro_x,gyro_y."),
    option("seconds", "--from", "Skip this much at the start.", python="start"),
    option("seconds", "--to", "Stop this long after the first time stamp.", python="stop"),
    option(
        "choice", "--kind", "Clock data: time error (phase), or fractional frequency.",
        choices=("phase", "frequency"),
    ),
    option("number", "--carrier", "Carrier frequency in Hz, for a phase in cycles or a frequency in Hz."),
    option("text", "--topic", "Topic of a ROS bag or message of a flight log: GYR[0]."),
    option("text", "--variable", "Array, group or table to read from a file with several."),
    option("file", "--layout", "YAML file that describes a raw binary log."),
    option("text", "--delimiter", "Delimiter of a text file: , ; tab blank |", choices=(",", ";", "tab", "blank", "|")),
    option("text", "--decimal", "Decimal mark of a text file.", choices=(".", ",")),
    option(
        "texts", "--repair", "Apply a repair before any analysis: drop_repeats.",
        metavar="REPAIR",
    ),
)  # fmt: skip
"""What every command that reads a log understands."""
BENCH = option(
    "text", "--config", "File of the bench with units, scale factors and names of channels, or none.",
    otherwise="allanite.toml beside LOG, else in the working folder", metavar="FILE", on_page=False,
)  # fmt: skip
"""The same for all logs of a bench, on the command line alone: what the page keeps of a log must not change."""
BENCH_FILE = "auto"
"""What it is where nobody names a file."""
