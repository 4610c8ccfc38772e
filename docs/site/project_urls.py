# SPDX-License-Identifier: BSD-3-Clause
"""The addresses of the project, made from one line of pyproject.toml: `repository` in [tool.allanite].

Called by the build (`tool.scikit-build.metadata.urls`). As long as the line is empty, the package states no address.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from pathlib import Path

__all__ = ["addresses", "dynamic_metadata", "repository"]

ROOT = Path(__file__).resolve().parent.parent.parent


def dynamic_metadata(field: str, settings: Mapping[str, object]) -> dict[str, str]:
    """The addresses of the package, for scikit-build-core."""
    if field != "urls" or settings:
        raise ValueError(f"{Path(__file__).name} makes the urls and takes no settings")
    return addresses(repository())


def repository() -> str:
    """The address of the repository; "" as long as there is none."""
    tools = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]
    return str(tools["allanite"]["repository"]).rstrip("/")


def addresses(repository: str) -> dict[str, str]:
    """What an index shows beside the description, by name."""
    if not repository:
        return {}
    return {
        "Source": repository,
        "Documentation": f"{repository}/blob/main/docs/index.md",
        "Changelog": f"{repository}/blob/main/CHANGELOG.md",
        "Issues": f"{repository}/issues",
    }
