# SPDX-License-Identifier: BSD-3-Clause
"""Files that lie, bombs, damage: an error that says so, before memory is spent and without harm."""

from __future__ import annotations

import gzip
import json
import lzma
import os
import pickle
import subprocess
import sys
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from allanite.errors import AllaniteError, DataQualityError, FormatError, InputError, LimitError, StorageError
from allanite.files.readers import parquet, read, sandbox, spool
from allanite.plain_files.limits import refuse_more
from allanite.recording.records import Recording
from hostile_files import mutations

#: The full number of mutations per format belongs to the long run: ALLANITE_MUTATIONS=2000.
MUTATIONS = int(os.environ.get("ALLANITE_MUTATIONS", "60"))


def table(path: Path, n: int = 1000) -> Path:
    np.save(path, np.random.default_rng(3).normal(size=(n, 3)))
    return path


class Trap:
    """Unpickled, it creates a file."""

    def __init__(self, marker: Path) -> None:
        self.marker = marker

    def __reduce__(self) -> tuple[Callable[..., Any], tuple[str, str]]:
        return open, (str(self.marker), "w")


_MEASURE = """
import json, resource, sys
import numpy, pyarrow, pyarrow.csv
from allanite.errors import LimitError
from allanite.files.readers import assembly, matlab, numpy_file, read, sandbox, text
def peak():
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
for path in json.load(sys.stdin):
    before = peak()
    try:
        read(path, rate=1)
    except LimitError as error:
        print(json.dumps([path, peak() - before, str(error)]))
"""


def refusals(paths: list[Path]) -> dict[str, tuple[int, str]]:
    """File name -> (memory that reading it took, message), measured in a fresh process; refused files only."""
    done = subprocess.run(
        [sys.executable, "-c", _MEASURE],
        input=json.dumps([str(p) for p in paths]),
        capture_output=True,
        text=True,
        check=True,
        timeout=120,
    )
    rows = [json.loads(line) for line in done.stdout.splitlines()]
    return {Path(path).name: (memory, message) for path, memory, message in rows}


# -- code in files -----------------------------------------------------------------------------------------


def test_f1_no_pickle_is_ever_opened(tmp_path: Path) -> None:
    marker = tmp_path / "marker"
    trap = np.array([Trap(marker)], dtype=object)
    np.save(tmp_path / "a.npy", trap, allow_pickle=True)
    np.savez(tmp_path / "a.npz", samples=np.zeros((10, 2)), trap=trap)
    for protocol in (2, 4, 5):
        (tmp_path / f"a{protocol}.pkl").write_bytes(pickle.dumps(Trap(marker), protocol=protocol))
    (tmp_path / "a.csv").write_bytes(pickle.dumps(Trap(marker)))
    for file in sorted(tmp_path.iterdir()):
        with pytest.raises(FormatError, match="pickle"):
            read(file, rate=1)
    assert not marker.exists()


# -- limits ------------------------------------------------------------------------------------------------


def test_the_limit_itself_is_read_and_one_more_is_refused() -> None:
    refuse_more(7, 7, "columns", "a.csv", "Divide it")
    with pytest.raises(LimitError, match="has 8 columns; at most 7 are read"):
        refuse_more(8, 7, "columns", "a.csv", "Divide it")


# -- bombs -------------------------------------------------------------------------------------------------


def bombs(folder: Path) -> dict[str, Path]:
    """Files of about a megabyte that unpack to 0.8 GB (a zip and an xz of 0.1 GB: their packers are slow)."""
    zeros = bytes(1 << 20)
    header = b"{'descr': '<f8', 'fortran_order': False, 'shape': (13107200,), }".ljust(117) + b"\n"
    with (
        zipfile.ZipFile(folder / "a.npz", "w", zipfile.ZIP_DEFLATED) as archive,
        archive.open("a.npy", "w") as member,
    ):
        member.write(b"\x93NUMPY\x01\x00v\x00" + header)
        for _ in range(100):
            member.write(zeros)
    line = b"0.0,0.0\n" * (1 << 17)
    (folder / "a.csv.gz").write_bytes(gzip.compress(line) * 800)
    with lzma.open(folder / "a.csv.xz", "wb", preset=0) as packed:
        for _ in range(100):
            packed.write(line)
    engine = zlib.compressobj(9)
    start = engine.compress(zeros) + engine.flush(zlib.Z_FULL_FLUSH)
    again = engine.compress(zeros) + engine.flush(zlib.Z_FULL_FLUSH)  # may follow itself any number of times
    body = start + again * 800
    head = b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM"
    (folder / "a.mat").write_bytes(head + (15).to_bytes(4, "little") + len(body).to_bytes(4, "little") + body)
    return {p.name: p for p in folder.iterdir()}


def test_f2_bombs_are_refused_before_64_mb_of_memory(tmp_path: Path) -> None:
    made = bombs(tmp_path)
    assert max(p.stat().st_size for p in made.values()) < 2e6
    refused = refusals(sorted(made.values()))
    assert set(refused) == set(made)
    for name, (memory, message) in refused.items():
        assert "bomb" in message, name
        assert memory < 64 << 20, name


def test_f2_honest_packed_text_is_read(tmp_path: Path) -> None:
    text = "".join(f"{k / 10:.1f},{np.sin(k):.6f}\n" for k in range(2000)).encode()
    (tmp_path / "a.csv").write_bytes(b"t,wx\n" + text)
    (tmp_path / "a.csv.gz").write_bytes(gzip.compress(b"t,wx\n" + text[:9000]) + gzip.compress(text[9000:]))
    (tmp_path / "a.csv.xz").write_bytes(lzma.compress(b"t,wx\n" + text))
    expected = read(tmp_path / "a.csv").values("wx")
    for name in ("a.csv.gz", "a.csv.xz"):
        assert np.array_equal(read(tmp_path / name).values("wx"), expected)
    whole = (tmp_path / "a.csv.gz").read_bytes()
    (tmp_path / "cut.gz").write_bytes(whole[:-30])
    with pytest.raises(FormatError, match=r"truncated|damaged"):
        read(tmp_path / "cut.gz")
    (tmp_path / "binary.gz").write_bytes(gzip.compress(np.random.default_rng(1).bytes(5000)))
    with pytest.raises(FormatError, match="does not contain compressed text"):
        read(tmp_path / "binary.gz")


def test_f6_a_line_of_a_gigabyte_costs_no_memory(tmp_path: Path) -> None:
    path = tmp_path / "line.csv"
    with path.open("wb") as file:  # a sparse file: NUL bytes take no room on the disk
        file.write(b"t,wx\n0.0,1.5\n0.1,")
        file.write(b"1" * (2 << 20))
        file.seek(1 << 30)
        file.write(b"\n")
    other = tmp_path / "one.csv"
    other.write_bytes(b"1" * (3 << 20))
    refused = refusals([path, other])
    assert "line 3" in refused["line.csv"][1]
    assert "line 1" in refused["one.csv"][1]
    assert max(memory for memory, _ in refused.values()) < 64 << 20


def test_f6_a_million_columns(tmp_path: Path) -> None:
    path = tmp_path / "wide.csv"
    path.write_text("1," * 5000 + "1\n" + "2," * 5000 + "2\n")
    with pytest.raises(LimitError, match="columns"):
        read(path, rate=1)
    path.write_text("1," * 1_000_000 + "1\n")
    with pytest.raises(LimitError, match="longer"):
        read(path, rate=1)


# -- headers that lie --------------------------------------------------------------------------------------


def npy(shape: str, descr: str = "'<f8'", body: bytes = b"", header: str | None = None) -> bytes:
    text = (
        header if header is not None else f"{{'descr': {descr}, 'fortran_order': False, 'shape': {shape}, }}"
    )
    return b"\x93NUMPY\x01\x00" + len(text).to_bytes(2, "little") + text.encode() + body


@pytest.mark.parametrize(
    ("content", "hint"),
    [
        (npy("(1000000000000,)"), "missing"),
        (npy("(-1,)"), "damaged"),
        (npy("(True,)"), "damaged"),
        (npy("", header="(" * 9000), "cannot be read"),
        (npy("", header="-" * 16000 + "1"), "cannot be read"),
        (npy("", header="x" * 60000), "60000 bytes"),
        (npy("(5,)", body=bytes(40 + 400)), "400 bytes follow"),
        (npy("(5,)", body=bytes(20)), "20 bytes are missing"),
        (npy("(5,)", descr="'O'", body=bytes(40)), "pickle"),
        (npy("(5,)", descr="'<f99'", body=bytes(40)), "cannot be read"),
        (npy("(5,)", descr="[('a', 'O')]", body=bytes(40)), "pickle"),
        (b"\x93NUMPY\x09\x00" + bytes(50), "version"),
    ],
)
def test_f3_npy_headers_that_lie(tmp_path: Path, content: bytes, hint: str) -> None:
    path = tmp_path / "a.npy"
    path.write_bytes(content)
    with pytest.raises(FormatError, match=hint):
        read(path, rate=1)


@pytest.mark.parametrize(
    ("array", "hint"),
    [
        (np.zeros(10, bool), r"bool.*\(10,\)"),
        (np.zeros(10, complex), "complex128"),
        (np.array(["a"] * 10), "<U1"),
        (np.float64(3.0), r"\(\)"),
        (np.zeros((2, 3, 4)), r"\(2, 3, 4\)"),
        (np.zeros((30, 100)), "transpose"),
    ],
    ids=["bool", "complex", "text", "scalar", "cube", "wrong axis"],
)
def test_b10_arrays_that_are_no_samples(tmp_path: Path, array: Any, hint: str) -> None:
    np.save(tmp_path / "a.npy", array)
    with pytest.raises(InputError, match=hint):
        read(tmp_path / "a.npy", rate=1)


@pytest.mark.parametrize(
    "content", [b"", bytes(5000), b"\x00\x01\x02\x03" * 1000], ids=["empty", "NUL", "binary"]
)
def test_files_without_anything_in_them(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "a.csv"
    path.write_bytes(content)
    with pytest.raises(FormatError, match=r"empty|binary"):
        read(path)


def test_b3_no_samples(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("t,wx\n")
    with pytest.raises(FormatError, match="no table of numbers"):
        read(tmp_path / "a.csv")
    np.save(tmp_path / "a.npy", np.zeros(0))
    with pytest.raises(DataQualityError, match="no samples"):
        read(tmp_path / "a.npy", rate=1)


# -- mutations ---------------------------------------------------------------------------------------------


def test_f4_mutations_of_npy(tmp_path: Path) -> None:
    content = table(tmp_path / "a.npy", 100).read_bytes()
    outcomes = {"read": 0, "refused": 0}
    for mutant in mutations(content, MUTATIONS):
        (tmp_path / "m.npy").write_bytes(mutant)
        try:
            recording = read(tmp_path / "m.npy", rate=1)
            assert isinstance(recording, Recording)
            recording.raw(recording.names[0])
            outcomes["read"] += 1
        except AllaniteError:
            outcomes["refused"] += 1
    assert outcomes["read"] > 0
    assert outcomes["refused"] > 0


# Parses many files as the reader's child does, one fork each, so that the imports are paid once.
_HARNESS = """
import json, os, sys
import scipy.io
from allanite.files.readers.matlab import arrays_in
from allanite.files.readers.sandbox import limit
outcomes = []
for path in json.load(sys.stdin):
    child = os.fork()
    if child == 0:
        limit(256 << 20, 5)
        try:
            arrays_in(path)
        except Exception:
            os._exit(1)
        os._exit(0)
    status = os.waitpid(child, 0)[1]
    outcomes.append("signal" if os.WIFSIGNALED(status) else ("read", "refused")[os.WEXITSTATUS(status)])
print(json.dumps(outcomes))
"""


@pytest.mark.long
def test_f4_mutations_of_mat_kill_at_most_the_child(tmp_path: Path) -> None:
    from scipy.io import savemat

    savemat(tmp_path / "a.mat", {"x": np.arange(12.0).reshape(6, 2)})
    content = (tmp_path / "a.mat").read_bytes()
    known = bytearray(content)
    known[176] ^= 0x5B  # the tag byte that ends the parser by a signal
    files = []
    for i, mutant in enumerate([bytes(known), *mutations(content, MUTATIONS)]):
        files.append(tmp_path / f"{i}.mat")
        files[-1].write_bytes(mutant)
    done = subprocess.run(
        [sys.executable, "-c", _HARNESS],
        input=json.dumps([str(f) for f in files]),
        capture_output=True,
        text=True,
        check=True,
        timeout=300,
    )
    outcomes = json.loads(done.stdout)
    assert len(outcomes) == len(files)
    assert set(outcomes) <= {"read", "refused", "signal"}
    # Through the reader: a signal is a FormatError here, and this process lives.
    worst = files[outcomes.index("signal")] if "signal" in outcomes else files[outcomes.index("refused")]
    with pytest.raises(FormatError, match="damaged"):
        read(worst, rate=1)


# -- the sandbox -------------------------------------------------------------------------------------------


def bad_child(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, body: str) -> str:
    """Name of a function in a module of its own, for a child to call."""
    (tmp_path / "badchild.py").write_text(f"def work():\n    {body}\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    return "badchild:work"


@pytest.mark.parametrize(
    ("body", "error", "hint"),
    [
        ("import os, signal; os.kill(os.getpid(), signal.SIGSEGV)", FormatError, "signal 11"),
        ("bytearray(1 << 30); return None, {}", LimitError, "64 MiB"),
        ("while True: pass", LimitError, "processor time"),
        ("import os; os._exit(3)", FormatError, "status 3"),
        ("raise KeyError('tag')", FormatError, "KeyError"),
    ],
    ids=["crash", "memory", "time", "exit", "exception"],
)
def test_sandbox_limits(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, body: str, error: type[Exception], hint: str
) -> None:
    function = bad_child(tmp_path, monkeypatch, body)
    with pytest.raises(error, match=hint):
        sandbox.run(function, [], imports=[], memory=64 << 20, seconds=1, name="a.mat")


def test_limits_of_the_child_stay_below_those_of_this_process() -> None:
    """Where processor time is limited already (`ulimit -t`), the child may not ask for more, and need not."""
    sample = Path(__file__).parents[1] / "samples" / "matlab" / "vectors.mat"
    script = (
        "import resource, sys; resource.setrlimit(resource.RLIMIT_CPU, (25, 25)); "
        "from allanite.files.readers import read; print(read(sys.argv[1], rate=100).n_samples)"
    )
    done = subprocess.run(
        [sys.executable, "-c", script, str(sample)], capture_output=True, text=True, timeout=60, check=False
    )
    assert done.returncode == 0, done.stderr
    assert int(done.stdout) > 0


@pytest.mark.parametrize("words", ["memory allocation of 17179869184 bytes failed", "std::bad_alloc"])
def test_a_library_that_aborts_for_want_of_memory_is_a_limit(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, words: str
) -> None:
    body = f"import os, sys; os.write(2, {words.encode()!r}); os.abort()"
    function = bad_child(tmp_path, monkeypatch, body)
    with pytest.raises(LimitError, match="more than 64 MiB of memory"):
        sandbox.run(function, [], imports=[], memory=64 << 20, seconds=5, name="a.xlsx")


def test_sandbox_hands_back_arrays(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    function = bad_child(
        tmp_path, monkeypatch, "import numpy as np; return 7, {'a/b': np.arange(50000.0), 'c': np.ones(2)}"
    )
    data, arrays = sandbox.run(function, [], imports=["numpy"], memory=64 << 20, seconds=5, name="a")
    assert data == 7
    assert np.array_equal(arrays["a/b"], np.arange(50_000.0))
    assert np.array_equal(arrays["c"], [1, 1])


# -- the spool ---------------------------------------------------------------------------------------------


def test_growing_column_moves_to_a_file_and_changes_its_type(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(spool, "_IN_MEMORY", 1000)
    column = spool.GrowingColumn()
    parts = [np.arange(k, k + 100) for k in range(0, 1000, 100)]
    for part in parts:
        column.append(part)
    column.append(np.array([0.5, np.nan]))
    finished = column.finish()
    assert finished.dtype == np.float64
    assert np.array_equal(finished.read(0, 1002), [*range(1000), 0.5, np.nan], equal_nan=True)
    whole = spool.GrowingColumn()
    for part in parts:
        whole.append(part)
    assert whole.finish().dtype == np.int64
    single = spool.GrowingColumn(np.dtype(np.float32))
    for part in parts:
        single.append(part.astype(np.float32) + np.float32(0.5))
    mapped = single.finish_array()
    assert mapped.dtype == np.float32
    assert np.array_equal(mapped, np.arange(1000) + 0.5)


def test_a_column_in_pieces_reads_any_stretch(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(spool, "_SMALL", 100)
    column = spool.GrowingColumn(beside=8)
    for start, stop in ((0, 40), (40, 40), (40, 41), (41, 100)):
        column.append(np.arange(start, stop, dtype=np.int64 if start == 0 else np.float64))
    finished = column.finish()
    assert type(finished).__name__ == "_Pieces"
    assert (len(finished), finished.dtype, finished.origin) == (100, np.float64, 0.0)
    for start in (0, 1, 39, 40, 41, 42, 99):
        for stop in (start, start + 1, 40, 41, 100, 200):
            wanted = np.arange(100.0)[start:stop]
            assert np.array_equal(finished.read(start, stop), wanted), (start, stop)
            assert finished.read(start, stop).dtype == np.float64


def test_a_full_disk_is_a_storage_error() -> None:
    with pytest.raises(StorageError, match="TMPDIR"), Path("/dev/full").open("wb", buffering=0) as full:
        spool.to_file([b"x" * 100], full)


# -- names in files ----------------------------------------------------------------------------------------


def test_f10_names_command_no_terminal(tmp_path: Path) -> None:
    """Escape sequences, NUL and marks that turn the direction of a text are in no name of a channel but escaped."""
    names = ["g\x1b[31mx", "g\u202ey", "g\x00z", "\x07", "gyro √ 1"]
    rows = "".join(f"{k / 10},1,2,3,4,5.{k}\n" for k in range(20))
    (tmp_path / "a.csv").write_text("t," + ",".join(names) + "\n" + rows, encoding="utf-8")
    found = read(tmp_path / "a.csv")
    assert found.names == (r"g\u001b[31mx", r"g\u202ey", "gz", r"\u0007", "gyro_√_1")
    ours = Recording.from_rate(np.ones((20, 2)), rate=1.0, unit="deg/s", names=[names[0], "../../x"])
    parquet.write(ours, tmp_path / "a.parquet")  # as another program may: `write_recording` refuses the name
    assert read(tmp_path / "a.parquet").names == (r"g\u001b[31mx", "../../x")
