# SPDX-License-Identifier: BSD-3-Clause
"""The program `allanite`, also reached as ``python -m allanite``."""

from __future__ import annotations

__all__ = ["main"]


def main() -> None:
    """Run the command line; exit codes: 0 done, 1 failed, 2 usage, 3 finished with loss, 70 a defect in allanite."""
    from allanite.commands.cli import main as run

    run()


if __name__ == "__main__":
    main()
