# SPDX-License-Identifier: BSD-3-Clause
"""Files in, recordings out, and back.

``readers``         `read` and one module for each format; ``byte_layout`` the words of a layout of bytes
``store``           runs on disk that survive the death of their recorder
``recording_file``  a recording into a file that `read` takes
``foreign_models``, ``foreign_curves``
    What other programs made of their records.

Foreign binary formats are parsed with limits, in a child process.
"""
