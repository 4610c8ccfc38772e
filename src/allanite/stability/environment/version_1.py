# SPDX-License-Identifier: BSD-3-Clause
"""Documents of version 1 held sentences for codes: what they say in the present version."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

from allanite.quantities.verdict import WordedCode
from allanite.stability.environment.verdict import CoefficientCause, HysteresisStatus, LagStatus

__all__ = ["upgraded", "upgraded_facts"]

Entry = Mapping[str, object]

_SETTLED = re.compile(r"the bias settles as after power-on, for some (\S+) s")
#: Codes of each part by the words of version 1.
_CAUSES = {
    "the temperature was constant, as far as its thermometer tells": CoefficientCause.CONSTANT,
    "the temperature is a straight line in time: a drift of the sensor explains it as well": CoefficientCause.STRAIGHT,
    "it cannot be told from the temperature itself in this record": CoefficientCause.COLLINEAR,
    "without a drift of the sensor itself it would be resolved: the temperature went with time": CoefficientCause.DRIFT,
}
_LAGS = {
    "a bias that depends on the rate of the temperature looks the same": LagStatus.RESOLVED,
    "the thermometer follows the sensor without a lag that the record shows": LagStatus.NO_LAG,
    "the rate of the temperature cannot be told from the temperature itself in this record": LagStatus.COLLINEAR,
    "the effect of the temperature is too small in the noise to show a lag": LagStatus.TOO_SMALL,
}
_BRANCHES = {
    "warming and cooling differ at one temperature, beyond what a lag would do": HysteresisStatus.FOUND,
    "warming and cooling do not differ, as far as the record tells": HysteresisStatus.NOT_FOUND,
    "the temperature went one way only": HysteresisStatus.ONE_WAY,
    "warming and cooling have too few temperatures in common": HysteresisStatus.LITTLE_IN_COMMON,
    "the branches cannot be told from the temperature and its rate in this record": HysteresisStatus.COLLINEAR,
}


def upgraded(data: Entry) -> dict[str, object]:
    """The document of `environment`, version 1, as one of version 2; its channels are upgraded as they are read."""
    channels = data.get("channels")
    first = channels[0] if isinstance(channels, Sequence) and channels else None
    confidence = first.get("confidence") if isinstance(first, Mapping) else None
    return {"confidence": confidence, **data, "version": 2}


def upgraded_facts(data: Entry) -> Entry:
    """A channel of a document of `environment`, or of a study; it is of version 1 where it has a reason."""
    if "reason" not in data:
        return data
    coefficients = data.get("coefficients")
    return {
        **data,
        "coefficients": [
            {**c, "cause": _CAUSES.get(str(c.get("note")))}
            for c in (coefficients if isinstance(coefficients, Sequence) else ())
            if isinstance(c, Mapping)
        ],
        "lag": _status(data.get("lag"), _LAGS),
        "hysteresis": _status(data.get("hysteresis"), _BRANCHES),
        "warm_up": _warm_up(data.get("warm_up")),
    }


def _status(data: object, codes: Mapping[str, WordedCode]) -> object:
    if not isinstance(data, Mapping):
        return data
    return {**data, "status": codes.get(str(data.get("says")), data.get("status"))}


def _warm_up(data: object) -> object:
    if not isinstance(data, Mapping):
        return data
    match = _SETTLED.match(str(data.get("says")))
    return {"settled": None if match is None else float(match[1]), **data}
