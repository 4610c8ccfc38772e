# SPDX-License-Identifier: BSD-3-Clause
"""Nobody who is given samples can change the record by writing into them, whatever file it was read from."""

import numpy as np
import pytest

import allanite as al

N = 5000


def recordings(folder):
    y = np.random.default_rng(3).standard_normal((N, 1)) * 1e-3
    made = al.Recording.from_rate(y.copy(), rate=100.0, unit="rad/s", names=["x"])
    al.write_recording(made, folder / "own.parquet")
    np.save(folder / "plain.npy", y)
    table = np.column_stack([np.arange(N) / 100, y])
    np.savetxt(folder / "log.csv", table, delimiter=",", header="time_s,x_rad_s", comments="")
    yield made
    yield al.read(folder / "own.parquet")
    yield al.read(folder / "plain.npy", rate=100.0, unit="rad/s")
    yield al.read(folder / "log.csv")


def test_samples_that_are_given_are_read_only(tmp_path):
    for recording in recordings(tmp_path):
        (name,) = recording.names
        for given in (recording.values(name), recording.raw(name), next(recording.blocks(name))[1]):
            with pytest.raises(ValueError, match="read-only"):
                given[0] = 7.0
        own = recording.scaled(name)  # a product of its own, which may be changed
        own[:] = 7.0
        assert np.abs(recording.raw(name)).max() < 1.0
