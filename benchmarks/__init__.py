# SPDX-License-Identifier: BSD-3-Clause
"""Side-by-side measurements; each script writes its numbers to ``results/``, which are committed."""
