# SPDX-License-Identifier: BSD-3-Clause
"""Text tables, and documents that a person or a program writes."""

from __future__ import annotations

from collections.abc import Iterator

from tests.hostile_shapes.shape import DEEP, DIGITS, RATE, HostileShape, Write, holding

# -- text --------------------------------------------------------------------------------------------------


def _rows(*cells: str, n: int = 30, head: str = "t,wx\n") -> Write:
    """A table with one odd cell in its middle."""
    lines = [f"{k / 10:.1f},{k * 0.5}" for k in range(n)]
    for k, cell in enumerate(cells):
        lines[n // 2 + k] = f"{(n // 2 + k) / 10:.1f},{cell}"
    return holding(head + "\n".join(lines) + "\n")


def _whole(cell: str) -> Write:
    """A table of whole numbers with an odd one."""
    return holding("n,wx\n" + "".join(f"{k},{k}\n" for k in range(20)) + f"20,{cell}\n21,1\n")


def text(wide: int) -> Iterator[HostileShape]:
    row = ",".join("1" for _ in range(wide)) + "\n"
    table: dict[str, tuple[Write, str]] = {
        "cell of 5000 digits": (_rows(DIGITS), "too large|64 bits|not a number"),
        "cell of 400 digits": (_rows("9" * 400), "too large|64 bits"),
        "line longer than the pieces it is read in": (_rows("7" * 40_000), "too large|64 bits"),
        "whole number of 5000 digits": (_whole(DIGITS), "64 bits"),
        "whole number of 400 digits": (_whole("9" * 400), "64 bits"),
        "number of 5000 decimals": (_rows("1." + DIGITS), ""),
        "exponent of 5000 digits": (_rows("1e" + DIGITS), "too large"),
        "1e400": (_rows("1e400"), "too large"),
        "one column of decimal commas, 5000 digits": (
            holding("".join(f"{DIGITS},0012\n" for _ in range(9))),
            "",
        ),
        "words before a comma": (holding("abc,123\nabc,124\n1,5\n2,6\n3,7\n4,8\n"), ""),
        "year 9999": (
            holding("t,wx\n" + "".join(f"9999-01-01T00:00:{k:02d},{k}\n" for k in range(9))),
            "9999",
        ),
        "year 0": (holding("t,wx\n" + "".join(f"0000-01-01T00:00:{k:02d},{k}\n" for k in range(9))), ""),
        "month 13": (holding("t,wx\n" + "".join(f"2020-13-01T00:00:{k:02d},{k}\n" for k in range(9))), ""),
        "digits of another script": (_rows("٣٤", "٣٤.٥"), ""),
        "superscript digits": (holding("".join(f"{k},²\n" for k in range(9))), ""),
        "rate of 5000 digits in the preamble": (
            holding(f"# rate: {DIGITS} Hz\nwx\n" + "1.5\n" * 20),
            "",
        ),
        "interval of 1e-320 s in the preamble": (
            holding("# dt: 1e-320 s\nwx\n" + "1.5\n" * 20),
            "",
        ),
        "unit to the power of 5000 digits": (
            holding(f"t,wx [rad/s^{DIGITS}]\n" + "".join(f"{k},{k}.5\n" for k in range(20))),
            "",
        ),
        "too many columns": (holding(row * 3), "columns"),
        "too many columns in one line only": (holding("1,2\n" * 20 + row + "1,2\n" * 20), ""),
        "heading of 100 000 blanks": (holding("t," + " " * 100_000 + "x\n" + "1,2\n" * 20), ""),
        "100 000 brackets in the heading": (holding("t," + "[" * 100_000 + "\n" + "1,2\n" * 20), ""),
        "preamble of 200 000 signs": (holding("# rate " * 30_000 + "\nt,wx\n" + "1,2\n" * 20), ""),
        "quotes that never end": (holding('t,wx\n1,"2\n' + "3,4\n" * 5000), ""),
        "sentence of 3000 fields": (holding(("$A" + ",1" * 3000 + "*00\n") * 9), ""),
        "100 000 signs that begin a sentence": (holding("$AB,1*00\n" * 9 + "$A" * 100_000 + "\n"), ""),
        "100 000 labels, no two alike": (
            holding("".join(f"k{k}:1 g{k}:2\n" for k in range(50_000))),
            "no table",
        ),
        "labels in a chain of 400": (
            holding("".join(f"k{k}:1 k{k + 1}:2\n" for k in range(400)) * 40),
            "",
        ),
        "5000 labels in a line": (
            holding((" ".join(f"k{k}:1" for k in range(5000)) + "\n") * 5),
            "labels",
        ),
        "letters that may begin a label": (holding("gx:1 gy:2\n" * 50 + "a-" * 500_000 + "\n"), ""),
        "objects 30 000 deep": (holding('{"a":1}\n' * 20 + '{"a":' * 30_000 + "\n"), ""),
        "label of 5000 digits": (holding(f"gx:{DIGITS} gy:2\n" * 20), ""),
        "object of 1e400": (holding('{"gx":1e400,"gy":2}\n' * 20), ""),
        "year of 400 digits": (
            holding("year,month,day,hour,minute,second,wx\n" + f"{'9' * 18},1,1,1,1,1,1\n" * 20),
            "",
        ),
        "intervals of 1e308": (holding("dt,wx\n" + "1e308,1\n" * 50), ""),
        "only delimiters": (holding("," * 4000 + "\n" + "," * 4000 + "\n"), "no table"),
        "time stamps of 1e300": (_rows("1", head="t,wx\n1e300,1\n-1e300,2\n"), ""),
        "stamps that jump by 1e15 s": (
            holding("t,wx\n" + "".join(f"{k / 10 + (k > 50) * 1e15!r},{k}.5\n" for k in range(100))),
            "",
        ),
    }
    for name, (write, says) in table.items():
        options = RATE if "column" in name or "comma" in name else {}
        yield HostileShape(name=f"text, {name}", file="a.csv", write=write, says=says, options=options)


# -- documents ---------------------------------------------------------------------------------------------

_LAYOUT = "rate: 100\nframe:\n  fields:\n    - {name: gyro_x, type: f32}\n"


def _bomb(levels: int) -> str:
    """Aliases of aliases."""
    lines = ["a0: &a0 [1, 1, 1, 1, 1, 1, 1, 1, 1]"]
    lines += [f"a{k}: &a{k} [{', '.join([f'*a{k - 1}'] * 9)}]" for k in range(1, levels)]
    return "\n".join(lines) + "\n"


def documents() -> Iterator[HostileShape]:
    texts = {
        "nesting of brackets": "[" * DEEP,
        "nesting of braces": "{a: " * 12_000,
        "nesting by dashes": "- " * DEEP + "a\n",
        "nesting by columns": "".join(" " * k + f"a{k}:\n" for k in range(600)),
        "aliases of aliases": _bomb(9),
        "an alias of itself": "a: &a [*a]\n",
        "merge keys": "a: &a {x: 1}\n"
        + "".join(f"b{k}: {{<<: [{', '.join(['*a'] * 200)}]}}\n" for k in range(100)),
        "number of 5000 digits": f"rate: {DIGITS}\n",
        "number of 5000 hexadecimal digits": f"rate: 0x{'f' * 5000}\n",
        "number of 5000 sixties": "rate: 1" + ":59" * 5000 + "\n",
        "1e400": "rate: 1e400\n",
        "date of year 9999999": "rate: 9999999-99-99\n",
        "date that is none": "rate: 2020-13-45\n",
        "quarter of a megabyte of entries": "- {a: 1, b: 2}\n" * 17_000,
        "quarter of a megabyte of comments": "# x\n" * 65_000,
        "many anchors": "".join(f"- &a{k} 1\n" for k in range(20_000)),
        "a key that is a list": "? [1, 2]\n: 3\n",
        "a key that is a map": "? {a: 1}\n: 3\n",
        "two documents": "a: 1\n---\nb: 2\n",
        "NUL": "a: \0\n",
        "binary that is none": "a: !!binary '%%%'\n",
        "a set": "a: !!set {b, c}\n",
        "directive of version 9": "%YAML 9.9\n---\na: 1\n",
        "tag that is a program": "a: !!python/object/apply:os.system ['true']\n",
    }
    for role, file in (("layout", "a.yaml"), ("model", "imu.yaml")):
        for name, text in texts.items():
            yield HostileShape(
                name=f"YAML for {role}, {name}", file=file, write=holding(text), role=role, says=" "
            )
    layouts = {
        "5000 fields": "rate: 100\nframe:\n  fields:\n"
        + "".join(f"  - {{name: f{k}, type: u8}}\n" for k in range(5000)),
        "scale 1e400": _LAYOUT.replace("f32}", "f32, scale: 1e400}"),
        "missing of 60 digits": _LAYOUT.replace("f32}", f"u8, missing: [{'9' * 60}]}}"),
        "skip of 300 digits": f"skip: {'9' * 30}\n" + _LAYOUT,
        "unit to a high power": _LAYOUT.replace("f32}", "f32, unit: 'rad/s^" + "9" * 300 + "'}"),
    }
    for name, text in layouts.items():
        yield HostileShape(name=f"layout, {name}", file="a.yaml", write=holding(text), role="raw", says=" ")


def json_documents() -> Iterator[HostileShape]:
    study = '{"format": "allanite-study", "version": 1, "recording": '
    texts = {
        "nesting of brackets": "[" * DEEP,
        "nesting that ends": "[" * 900 + "]" * 900,
        "nesting of objects": '{"a":' * DEEP,
        "number of 5000 digits": DIGITS,
        "study of 5000 digits": study + DIGITS + "}",
        "study of 400 digits": study + "9" * 400 + "}",
        "study of 1e400": study + "1e400}",
        "study that is nested": study + "[" * 900 + "]" * 900 + "}",
        "study of infinity": study + "Infinity}",
        "list": "[]",
        "number": "1e400",
        "text": '"a"',
        "null": "null",
        "one model of 1e400": '{"terms": [{"type": "white", "N": 1e400}]}',
        "one model of 400 digits": '{"terms": [{"type": "white", "N": ' + "9" * 400 + "}]}",
        "a model of a list": '{"terms": {"type": 5}}',
        "a model without a type": '{"terms": [{}]}',
        "a model of texts": '{"terms": [{"type": "white", "N": "a"}]}',
        "a model of two names": '{"terms": [{"type": ["white"], "N": 1}]}',
        "MATLAB of 400 digits": '{"SampleRate": ' + "9" * 400 + ', "Gyroscope": {"NoiseDensity": 1}}',
        "MATLAB filter of zeros": '{"SampleRate": 100, "Gyroscope": {"BiasInstabilityCoefficients": '
        '{"Numerator": 1e300, "Denominator": [1e-300, -1e-301]}}}',
        "bytes that are no text": "\udcff",
        "calibration of 400 digits": '{"format": "allanite-calibration", "version": 1, "rate": '
        + "9" * 400
        + "}",
    }
    for role in ("model", "study", "calibration"):
        for name, text in texts.items():
            content = text.encode("utf-8", "surrogateescape")
            yield HostileShape(
                name=f"JSON for {role}, {name}", file="a.json", write=holding(content), role=role, says=" "
            )
