# SPDX-License-Identifier: BSD-3-Clause
"""Questions to the 3458A, each with its own answer.

The meter repeats no question in its answer, so an answer that comes late looks like that of the next question. Answers
come in their order, though: once the meter answers with a number that nobody has used before, all earlier ones are
over. NRDGS takes such a number, and is set anew before the meter is armed.
"""

from __future__ import annotations

import secrets
import time
from collections.abc import Sequence

from allanite.acquisition.instruments import InstrumentTimeout
from allanite.acquisition.instruments.hp3458a import commands
from allanite.acquisition.instruments.hp3458a.transports import Transport
from allanite.errors import InstrumentError

__all__ = ["Conversation"]

#: Longest wait for the answer to a query [s]; RESET keeps the meter busy for a while.
ANSWER = 5.0
#: Longest draining of what an interrupted meter still sends [s]; quiet for so long, it has ended.
DRAIN, QUIET = 3.0, 0.1
#: Numbers that are tried before the link is refused, as long as something is answered.
TRIES = 3
#: Numbers of seven digits, which no other answer has.
_FIRST, _COUNT = 1_000_000, 9_000_000


class Conversation:
    """What is said to one meter over one link, from its beginning out of step.

    Parameters
    ----------
    link : Transport
    trigger : sequence of str
        Lines that set the trigger again after `agree`.
    """

    def __init__(self, link: Transport, trigger: Sequence[str]) -> None:
        self._link, self._trigger = link, trigger
        self._number = secrets.randbelow(_COUNT)
        self._in_step = False

    def send(self, line: str) -> None:
        """One line of commands."""
        self._link.write(line.encode("ascii"))

    def ask(self, query: str, timeout: float | None = None) -> str:
        """The answer to this query, and to no other.

        Raises
        ------
        InstrumentTimeout
            None within `timeout` seconds, `ANSWER` by default. The next question waits until this one is over.
        InstrumentError
            As of `agree`.
        """
        if not self._in_step:
            self.bring_to_rest()
            self.agree()
        timeout = ANSWER if timeout is None else timeout
        self.send(query)
        answer = self._link.read_line(timeout)
        if not answer.endswith(b"\n"):
            self._in_step = False
            raise InstrumentTimeout(
                f"3458A: {query} got {answer!r} and no end of line within {timeout:g} s; is the address right, and "
                "is the meter switched on and not in use by another program?"
            )
        return answer.decode("ascii", "replace")

    def agree(self) -> None:
        """See that the next answer is that of the next question; what comes before is dropped. The meter is idle here.

        Raises
        ------
        InstrumentTimeout
            Nothing was answered.
        InstrumentError
            Something else was, each time.
        """
        self._in_step = False
        for _ in range(TRIES):
            self._number = (self._number + 1) % _COUNT
            number = _FIRST + self._number
            self.send(f"NRDGS {number},AUTO")
            self.send("NRDGS?")
            other, agreed = self._read_up_to(number)
            if agreed:
                for line in self._trigger:
                    self.send(line)
                self._in_step = True
                return
            if not other:
                raise InstrumentTimeout(
                    f"3458A: no answer to NRDGS? within {ANSWER:g} s; is it a 3458A, is the address right, and is it "
                    "switched on and not in use by another program?"
                )
        raise InstrumentError(
            f"3458A: NRDGS? answers {other!r} and not the number just set; is it a 3458A, and does another program use "
            "this line? Switch the meter off and on, and try again"
        )

    def bring_to_rest(self) -> bool:
        """Device clear, hold, and drain; whether it became quiet."""
        self._link.clear()
        self.send(commands.CLEAR[0])
        return self.drain()[1]

    def drain(self, quiet: float | None = None) -> tuple[bytes, bool]:
        """Read until nothing comes for `quiet` seconds; what came, and whether it became quiet in time."""
        deadline = time.monotonic() + DRAIN
        came = bytearray()
        while time.monotonic() < deadline:
            part = self._link.read_bytes(4096, QUIET if quiet is None else quiet, message=None)
            if not part:
                return bytes(came), True
            came += part
        return bytes(came), False

    def _read_up_to(self, number: int) -> tuple[bytes, bool]:
        """Lines up to the one that begins with this number: the last other one, and whether it came."""
        deadline, other = time.monotonic() + ANSWER, b""
        while (left := deadline - time.monotonic()) > 0 and (line := self._link.read_line(left)):
            if line.endswith(b"\n") and line.replace(b",", b" ").split()[:1] == [b"%d" % number]:
                return other, True
            other = line
        return other, False
