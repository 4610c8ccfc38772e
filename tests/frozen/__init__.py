# SPDX-License-Identifier: BSD-3-Clause
"""What the program says today, door by door: a refactoring leaves it equal.

``records``  the logs, tables and documents that go in, made with NumPy alone;
``results``  which commands run over them, written in results.toml;
``doors``    what is kept of what comes out: terminal, document, tables, report, figure;
``page``     what `allanite serve` offers: its forms, and what it would run;
``compared`` what counts as equal;
``golden``   what is kept.

``python -m tests.frozen --check`` compares, ``--write tests/frozen/golden`` freezes anew.
"""

import os

# Before NumPy: with several threads a matrix library adds up in another order.
for _library in ("OPENBLAS", "OMP", "MKL"):
    os.environ[f"{_library}_NUM_THREADS"] = "1"
