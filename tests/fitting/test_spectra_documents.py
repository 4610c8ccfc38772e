# SPDX-License-Identifier: BSD-3-Clause
"""Documents of spectra: there and back, and those of version 1."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from allanite.errors import FormatError
from allanite.fitting.spectral.spectra import ModelAgreement, Spectra
from allanite.study.result_document import read_document
from allanite.views.report import html_of, render_file
from bettered import bettered

OLD = Path(__file__).parent / "documents"


def old(name: str) -> dict[str, Any]:
    return json.loads((OLD / f"spectrum-1-{name}.json").read_text(encoding="utf-8"))


@pytest.mark.parametrize("name", ["agrees", "disagrees", "welch", "parameters", "constant"])
def test_version_1_says_what_it_said(name: str, tmp_path: Path) -> None:
    before = old(name)
    document = read_document(Spectra, before)
    after: Spectra = document.result
    for was, channel in zip(before["channels"], after.channels, strict=True):
        if was["expected"] is None:
            assert channel.agreement is None and channel.expected is None
        else:
            assert channel.expected is not None
            np.testing.assert_allclose(channel.expected, was["expected"], rtol=1e-4)
            assert channel.reason == (
                bettered(was["disagreement"]) or ("" if was["compared"] else channel.reason)
            )
            assert channel.compared == was["compared"]
    again = json.loads(json.dumps(document.to_json(), allow_nan=False))
    assert again["version"] == 2 and read_document(Spectra, again).to_json() == again
    source = tmp_path / "spectrum.json"
    source.write_text(json.dumps(before))
    page = render_file(source, tmp_path / "report.html").read_text(encoding="utf-8")
    assert all(c.get("unresolved", "") in page for c in before["channels"])
    assert html_of(again) == html_of(document)


def test_a_model_that_is_not_compared_is_not_said_to_agree() -> None:
    (channel,) = Spectra.from_json(old("welch")).channels
    assert channel.agreement is ModelAgreement.NOT_COMPARED and "log-binned" in channel.reason
    short = old("agrees")
    short["channels"][0]["compared"] = False
    (channel,) = Spectra.from_json(short).channels
    assert channel.agreement is ModelAgreement.NOT_COMPARED and channel.reason == "the record is too short"


def test_a_damaged_document_is_refused_with_its_place() -> None:
    document = Spectra.from_json(old("agrees")).to_json()
    document["channels"][0]["compared"] = "yes"  # type: ignore[index]
    with pytest.raises(FormatError, match=r"allanite-spectrum\.channels\[0\]\.compared: a bool is expected"):
        Spectra.from_json(document)
