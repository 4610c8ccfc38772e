# SPDX-License-Identifier: BSD-3-Clause
"""Files of a user: pipes, devices, sockets and folders are refused before they are opened, in every role."""

from __future__ import annotations

import ast
import contextlib
import json
import os
import shutil
import socket
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from allanite.errors import InputError, LimitError
from allanite.plain_files.regular_file import open_regular, read_regular, read_regular_text, regular

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = ROOT / "src" / "allanite"
SAMPLES = ROOT / "tests" / "samples"

pytestmark = pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no FIFOs")


# -- the functions -----------------------------------------------------------------------------------------


def irregular(folder: Path) -> dict[str, Path]:
    """One of each kind, and links to them."""
    os.mkfifo(folder / "fifo")
    (folder / "folder").mkdir()
    with socket.socket(socket.AF_UNIX) as bound, contextlib.chdir(folder):  # a socket's name is short
        bound.bind("socket")
    for name, target in (("link", "fifo"), ("zero", "/dev/zero")):
        (folder / name).symlink_to(target)
    return {p.name: p for p in folder.iterdir()}


@pytest.mark.parametrize("function", [regular, open_regular, read_regular, read_regular_text])
def test_what_is_no_regular_file_is_not_opened(tmp_path: Path, function: object) -> None:
    found = irregular(tmp_path)
    words = {
        "fifo": "a pipe",
        "link": "a pipe",
        "folder": "is a folder",
        "socket": "a socket",
        "zero": "a device",
    }
    assert set(found) == set(words)
    for name, said in words.items():
        with pytest.raises(InputError, match=said):
            function(found[name])  # type: ignore[operator]
    with pytest.raises(FileNotFoundError):
        function(tmp_path / "none")  # type: ignore[operator]


def test_what_becomes_a_pipe_after_the_look_is_neither_waited_for_nor_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    place = tmp_path / "log"
    os.mkfifo(place)
    monkeypatch.setattr("allanite.plain_files.regular_file.regular", lambda path: path)
    with pytest.raises(InputError, match="a pipe"):
        open_regular(place)


def test_size_and_marks(tmp_path: Path) -> None:
    place = tmp_path / "a"
    place.write_bytes(b"\xef\xbb\xbfa\r\nb\r")
    assert read_regular_text(place) == "a\nb\n"
    assert len(read_regular(place, 8)) == 8
    with pytest.raises(LimitError, match="has 8 bytes; at most 7"):
        read_regular(place, 7)


# -- every role --------------------------------------------------------------------------------------------

#: Arguments of the program; FIFO is a file that is a pipe, DEVICE a link to one, LOG a log that can be read.
REFUSED = [
    "info FIFO",
    "info DEVICE",
    "info LOG --layout FIFO",
    "info LOG --layout DEVICE",
    "characterize FIFO",
    "fit FIFO",
    "fit LOG --floor FIFO",
    "convert FIFO out.parquet",
    "export kalibr FIFO",
    "export kalibr FIFO.yaml",
    "export openvins LOG --model FIFO",
    "report FIFO",
    "simulate FIFO --rate 10 --duration 10 -o out.csv",
    "simulate FIFO.yaml --rate 10 --duration 10 -o out.csv",
    "filter LOG --model FIFO --unit deg/s",
    "diff FIFO FIFO",
    "compare FIFO FIFO",
    "compare FIFO.csv FIFO.csv",
    "spectrum FIFO",
    "align FIFO --latitude 50",
    "recover MANIFEST -o out",
    "recover SEGMENT -o out",
    "info MANIFEST",
    "info SEGMENT",
    "monitor MANIFEST --once",
    "info STORAGE",
]
#: Files beside the one that is named which are not opened at all, or only if they are regular.
NOT_LOOKED_AT = ["info METADATA", "info INDEX.tdms"]


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a pipe for every role, and a log LOG."""
    folder = tmp_path_factory.mktemp("pipes")
    for name in ("FIFO", "FIFO.yaml", "FIFO.csv"):
        os.mkfifo(folder / name)
    (folder / "DEVICE").symlink_to("/dev/zero")
    np.savetxt(folder / "LOG", np.random.default_rng(1).normal(size=(100, 1)), header="rate: 10 Hz")
    inside = (
        ("MANIFEST", "run/finished", "manifest.jsonl"),
        ("SEGMENT", "run/finished", "000002.arrows"),
        ("STORAGE", "rosbag/mcap", "mcap.mcap"),
        ("METADATA", "rosbag/mcap", "metadata.yaml"),
    )
    for name, sample, file in inside:
        shutil.copytree(SAMPLES / sample, folder / name)
        (folder / name / file).unlink()
        os.mkfifo(folder / name / file)
    shutil.copy(SAMPLES / "tdms" / "waveform.tdms", folder / "INDEX.tdms")
    os.mkfifo(folder / "INDEX.tdms_index")
    return folder


#: Runs the commands one after another, each with a second and more to end by itself.
_COMMANDS = """
import contextlib, io, json, signal, sys
from allanite.commands.cli import main
found = {}
for words in json.load(sys.stdin):
    said = io.StringIO()
    signal.alarm(60)
    with contextlib.redirect_stderr(said), contextlib.redirect_stdout(io.StringIO()):
        try:
            main(words.split())
            code = 0
        except SystemExit as end:
            code = end.code
    found[words] = [code, said.getvalue()]
print(json.dumps(found))
"""


@pytest.mark.long
def test_no_command_waits_for_a_pipe_or_reads_a_device(place: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-c", _COMMANDS],
        cwd=place,
        input=json.dumps([*REFUSED, *NOT_LOOKED_AT]),
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, done.stderr[-2000:]
    found = json.loads(done.stdout)
    for words in REFUSED:
        code, said = found[words]
        assert code == 1, (words, code, said)
        assert "not a regular file: it is not opened" in said, (words, said)
    for words in NOT_LOOKED_AT:
        assert found[words][0] == 0, (words, found[words])


def test_a_follower_waits_for_no_pipe(place: Path) -> None:
    from allanite.files.store.following import RunFollower
    from allanite.files.store.segment import opening_of

    opening = opening_of(place / "SEGMENT" / "000001.arrows")
    assert opening is not None
    follower = RunFollower(folder=place / "SEGMENT", header=opening.header)
    with pytest.raises(InputError, match="a pipe"):
        [follower.take() for _ in range(2)]


def test_standard_input_is_read_through_a_pipe(tmp_path: Path) -> None:
    text = "# rate: 10 Hz\nwx [deg/s]\n" + "".join(f"{k % 7}.5\n" for k in range(50))
    done = subprocess.run(
        [sys.executable, "-c", "from allanite.commands.cli import main; main()", "info", "-"],
        input=text,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "50" in done.stdout


# -- no other way in ---------------------------------------------------------------------------------------

#: Functions of libraries that open a path: what they get must come from `regular`, `open_regular`, `parquet_place`.
OPENERS = {
    "CalamineWorkbook.from_path", "OSFile", "ParquetFile", "TdmsFile.open", "ULog", "ZipFile", "feather.read_table",
    "h5py.File", "loadmat", "np.fromfile", "np.genfromtxt", "np.load", "np.loadtxt", "np.memmap", "pa.OSFile",
    "pa.memory_map", "pq.ParquetFile", "pq.read_schema", "pq.read_table", "sqlite3.connect", "zipfile.ZipFile",
}  # fmt: skip
#: Outside of what was changed with this: one line each.
#: Places that open a path all the same, and why they may.
MAY = {
    "acquisition/capture/device_lock.py": "the lock file of a device, which allanite makes",
    "commands/cli/child.py": "the null device",
    "commands/cli/options.py": "writes standard input to a temporary file",
    "commands/cli/recording.py": "the null device",
    "commands/curves.py": "a temporary file of its own",
    "commands/fleet/folder.py": "files that it has written",
    "commands/fleet/partitions.py": "files that it has written",
    "commands/fleet/log_process.py": "the null device, and /proc",
    "exporters/cpp.py": "a header of the package",
    "recording/block_series.py": "a temporary file of its own",
    "files/store/compaction.py": "the file that it has just written, to compare it",
    "commands/cli/program.py": "the null device in place of a closed pipe",
    "files/store/disk.py": "writes",
    "plain_files/durable.py": "what was written, for its descriptor",
    "files/readers/hdf5_tree.py": "a temporary file of its own",
    "files/readers/numpy_file.py": "a file that open_regular has opened",
    "files/readers/ardupilot/records.py": "a file that open_regular has opened",
    "files/readers/raw_records.py": "a file that open_regular has opened",
    "files/readers/rosbag/table.py": "writes to a temporary folder",
    "files/readers/sandbox.py": "files of its own child, and /proc",
    "files/readers/spool.py": "a temporary file of its own",
    "files/recording_file.py": "writes",
    "plain_files/regular_file.py": "is the way in",
    "stability/fleet/rows.py": "files that table_files has taken through regular",
    "views/figures/screen.py": "files of the package",
    "views/report/__init__.py": "files of the package",
    "views/report/templates.py": "files of the package",
}


def opened_paths(tree: ast.AST) -> Iterator[str]:
    """Calls that open a path which `regular` has not looked at."""
    for node in ast.walk(tree):
        if not isinstance(node, ast.Call):
            continue
        called = ast.unparse(node.func)
        given = ast.unparse(node.args[0]) if node.args else ""
        looked_at = "regular(" in given or given.startswith("parquet_place(")
        last = called.rpartition(".")[2]
        mode = [a.value for a in node.args if isinstance(a, ast.Constant) and isinstance(a.value, str)]
        if (
            called in ("open", "os.open", "io.open")
            or last == "read_text"
            or (last == "read_bytes" and not node.args)
            or (last == "open" and "." in called and any(m.strip("rwaxbt+") == "" for m in mode))
            or (called in OPENERS and not looked_at)
        ):
            yield called


def test_every_file_of_a_user_is_opened_in_one_way() -> None:
    found = {}
    words = {"open(", "read_text", "read_bytes", *(name.rpartition(".")[2] + "(" for name in OPENERS)}
    for module in sorted(PACKAGE.rglob("*.py")):
        name = module.relative_to(PACKAGE).as_posix()
        text = module.read_text(encoding="utf-8")
        # Parsed only where the text holds one of the words: that is a tenth of the modules.
        calls = list(opened_paths(ast.parse(text))) if any(word in text for word in words) else []
        if calls and not name.startswith("commands/page/"):
            found[name] = calls
    assert {k: v for k, v in found.items() if k not in MAY} == {}, (
        "open files with allanite.plain_files.regular_file"
    )
    assert set(MAY) <= set(found), "leave these out of the list"


def test_the_scan_sees_what_opens_a_path() -> None:
    text = """
open(p); os.open(p, 0); p.open("rb"); p.read_text(); p.read_bytes(); np.load(p); h5py.File(p, "r"); np.memmap(p)
h5py.File(regular(p), "r"); pa.memory_map(str(regular(p))); instrument.open(); archive.open(member); open_regular(p)
"""
    assert list(opened_paths(ast.parse(text))) == [
        "open", "os.open", "p.open", "p.read_text", "p.read_bytes", "np.load", "h5py.File", "np.memmap",
    ]  # fmt: skip
