# SPDX-License-Identifier: BSD-3-Clause
"""Seeded faults: small wrong changes of the source that a test must catch.

``faults.toml``  the faults, and the tests that catch each;
``scratch``      a copy of the tree in which one fault stands at a time;
``copied``       the plugin that makes the tests import that copy.

``python -m tests.faults`` tries all of them, ``python -m tests.faults ID ...`` some.
"""
