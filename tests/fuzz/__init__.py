# SPDX-License-Identifier: BSD-3-Clause
"""Changed files for every reader, the documents and the log store, for as long as one likes: ``python -m tests.fuzz``.

`seeds` has sound files of every format, `mutations` changes them, and each is opened in a process of its own
(`tests.hostile_files`). What fails is saved beside the command that repeats it; once mended, it goes to `regressions`.
"""
