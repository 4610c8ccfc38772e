# SPDX-License-Identifier: BSD-3-Clause
"""The jobs of `benchmarks.jobs` that are functions, of allanite and of others: each prepares what is timed."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

#: What one process prepares, and then what is timed of it.
Call = Callable[[Path], Callable[[], object]]

WEEK, STRETCH = 19_353_600, 23_040


def filtering(flicker: bool, gap_every: int = 0) -> Call:
    def prepared(_: Path) -> Callable[[], object]:
        import numpy as np

        from allanite.filtering.kalman import filter_recording
        from allanite.recording.records import Recording

        model, y = _model(flicker), _white(WEEK // 4 if gap_every else WEEK)
        if gap_every:
            y[gap_every::gap_every] = np.nan
        filter_recording(Recording.from_rate(y[:2000], rate=32.0, unit="rad/s", names="gyro"), model)
        source = Recording.from_rate(y, rate=32.0, unit="rad/s", names="gyro")
        return lambda: filter_recording(source, model)

    return prepared


def _model(flicker: bool, walk: bool = True) -> Any:
    from allanite.noise import NoiseModel

    from .records import FLICKER, WALK, WHITE

    return NoiseModel.of(WHITE, *[FLICKER] * flicker, *[WALK] * walk)


def _white(n: int) -> Any:
    import numpy as np

    return np.random.Generator(np.random.SFC64(7)).standard_normal(n) * 1.2e-3 + 1e-4


def filtering_by_statsmodels(flicker: bool) -> Call:
    def prepared(_: Path) -> Callable[[], object]:
        import numpy as np
        from statsmodels.tsa.statespace.kalman_filter import KalmanFilter

        space = _model(flicker).state_space(1 / 32, record=WEEK / 32).with_constant()
        n, y = space.size, _white(STRETCH)
        theirs = KalmanFilter(
            1, n, design=space.output[None], transition=space.transition, selection=np.eye(n)
        )
        theirs.bind(y[None, :].copy())
        theirs["obs_cov"], theirs["state_cov"] = [[space.noise]], space.process
        theirs.initialize_known(np.zeros(n), space.initial + np.diag(1.0 * space.diffuse))
        return lambda: theirs.filter()

    return prepared


def filtering_by_filterpy(flicker: bool) -> Call:
    def prepared(_: Path) -> Callable[[], object]:
        import numpy as np
        from filterpy.kalman import KalmanFilter

        space = _model(flicker).state_space(1 / 32, record=WEEK / 32).with_constant()
        theirs = KalmanFilter(dim_x=space.size, dim_z=1)
        theirs.F, theirs.Q, theirs.H = space.transition, space.process, space.output[None]
        theirs.R, theirs.P = np.array([[space.noise]]), space.initial + np.diag(1.0 * space.diffuse)

        def filtered() -> None:
            for value in _white(STRETCH):
                theirs.update(value)
                theirs.predict()

        return filtered

    return prepared


def likelihood(flicker: bool) -> Call:
    def prepared(_: Path) -> Callable[[], object]:
        from allanite.filtering.kalman.filtering import log_likelihood

        space, y = _model(flicker).state_space(1 / 32, record=WEEK / 32).with_constant(), _white(WEEK)
        log_likelihood(y[:2000], space)
        return lambda: log_likelihood(y, space)

    return prepared


def simulating(flicker: bool, walk: bool) -> Call:
    def prepared(_: Path) -> Callable[[], object]:
        from allanite import simulate

        model = _model(flicker, walk)
        simulate(model, rate=32.0, duration=60.0, seed=1)
        return lambda: simulate(model, rate=32.0, duration=WEEK / 32, seed=1)

    return prepared


def drawing_by_numpy(_: Path) -> Callable[[], object]:
    import numpy as np

    return lambda: np.random.Generator(np.random.SFC64(1)).standard_normal(WEEK)


def simulating_by_allantools(_: Path) -> Callable[[], object]:
    from allantools import noise

    return lambda: noise.white(STRETCH) + noise.pink(STRETCH) + noise.brown(STRETCH)


def reading(name: str) -> Call:
    def prepared(folder: Path) -> Callable[[], object]:
        from allanite import read

        def whole() -> None:
            recording = read(folder / name)
            for channel in recording.names:
                for _ in recording.blocks(channel):
                    pass

        return whole

    return prepared


def hashing_and_reading(name: str) -> Call:
    def prepared(folder: Path) -> Callable[[], object]:
        import hashlib

        from pyarrow import csv, parquet

        def whole() -> None:
            with (folder / name).open("rb") as file:
                hashlib.file_digest(file, "sha256")
            (parquet.read_table if name.endswith(".parquet") else csv.read_csv)(folder / name)

        return whole

    return prepared


def reading_by_arrow(folder: Path) -> Callable[[], object]:
    from pyarrow import csv

    return lambda: csv.read_csv(folder / "rows.csv")


def reading_by_polars(folder: Path) -> Callable[[], object]:
    import polars

    return lambda: polars.read_csv(folder / "rows.csv")


def reference(_: Path) -> Callable[[], object]:
    """Half a second of what the jobs consist of; the ratio to it is what a commit is compared by."""
    import numpy as np

    y = np.random.default_rng(0).standard_normal(1 << 20)

    def fixed() -> None:
        total = 0
        for i in range(1_500_000):
            total += i * i % 7
        for _ in range(4):
            np.fft.rfft(y)
            np.sort(y)
            np.cumsum(y).sum()

    return fixed
