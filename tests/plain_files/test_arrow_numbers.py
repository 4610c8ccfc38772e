# SPDX-License-Identifier: BSD-3-Clause
"""Numbers between Arrow and NumPy are those that pyarrow itself gives, without pandas."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

import allanite as al
from allanite.plain_files.arrow_numbers import arrow_of, numbers_of, whole_numbers_of

TYPES = [f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64)] + [
    "float16",
    "float32",
    "float64",
]


@st.composite
def columns(draw: st.DrawFn) -> tuple[NDArray[Any], NDArray[np.bool_]]:
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    n = draw(st.integers(0, 40))
    values = rng.bytes(8 * n)
    missing = rng.random(n) < draw(st.sampled_from([0.0, 0.3, 1.0]))
    dtype = np.dtype(draw(st.sampled_from(TYPES)))
    return np.frombuffer(values, dtype, n), missing


@given(columns(), st.integers(0, 40), st.integers(0, 40), st.booleans())
def test_numbers_of_whole_sliced_and_chunked_arrays_are_those_of_pyarrow(
    column: tuple[NDArray[Any], NDArray[np.bool_]], start: int, cut: int, masked: bool
) -> None:
    values, missing = column
    whole = pa.array(values, mask=missing if masked else None)
    assert arrow_of(values, missing if masked else None).equals(whole) or np.isnan(values).any()
    parts = whole[start:]
    for array in (whole, parts, pa.chunked_array([parts[:cut], parts[cut:], whole], whole.type)):
        theirs = (
            array.to_numpy() if isinstance(array, pa.ChunkedArray) else array.to_numpy(zero_copy_only=False)
        )
        ours = numbers_of(array)
        assert ours.dtype == theirs.dtype
        np.testing.assert_array_equal(ours, theirs)
        numbers, gone = whole_numbers_of(array)
        assert numbers.dtype == values.dtype
        np.testing.assert_array_equal(gone, array.is_null().to_pylist())
        np.testing.assert_array_equal(numbers[~gone], array.drop_null().to_numpy())


@pytest.mark.parametrize("kind", ["int16", "float64"])
def test_no_number_and_no_chunk(kind: str) -> None:
    for array in (pa.chunked_array([], kind), pa.array([], kind), pa.nulls(0, kind)):
        assert numbers_of(array).shape == (0,)
        assert numbers_of(array).dtype == kind


def test_a_buffer_that_is_too_short_is_refused() -> None:
    with pytest.raises(ValueError, match=r"(?i)buffer"):
        numbers_of(pa.Array.from_buffers(pa.float64(), 100, [None, pa.py_buffer(b"12345678")]))


def test_logs_are_read_and_written_without_pandas(tmp_path: Path) -> None:
    pytest.importorskip("pandas")
    rows = "".join(f"{i / 100:.2f},{i % 7}e-3,{i * i % 11}\n" for i in range(4000))
    (tmp_path / "log.csv").write_text("time_s,gx_rad_s,gy_rad_s\n" + rows)
    code = (
        "import sys, allanite as al; from pathlib import Path\n"
        "from allanite.files.recording_file import write_recording\n"
        "for name, kept in (('log.csv', 'log.parquet'), ('log.parquet', 'again.parquet')):\n"
        "    write_recording(al.read(name), Path(kept))\n"
        "assert al.check(al.read('again.parquet'))\n"
        "sys.exit('pandas' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, check=False, timeout=60)
    assert done.returncode == 0
    assert al.read(tmp_path / "again.parquet").n_samples == 4000
