"""Brings up the PDU link, and retries.

A radio may appear late, or may not support the configured settings.
"""

import asyncio
import contextlib
import time
from collections.abc import Callable, Coroutine
from typing import TypeVar

from msgspec.structs import replace

from backends import Patience
from sdrlinkd.config import Config, Setup
from sdrlinkd.errors import LinkAbsentError, LinkRefusedError, UserError
from sdrlinkd.pdulink import Carry, PduLink, PduListener
from sdrlinkd.reports import PduLinkReport

RETRY_S = 0.25, 2.0
"""First and longest wait in s before a retry; the wait doubles each time."""
BEING_OPENED = "it is being opened"

T = TypeVar("T")
Make = Callable[[Setup, Patience, float], PduLink]


class Opening:
    """Owns the PDU link, and the `state` and `reason` while it is not up.

    `make` builds a PDU link from a configuration, with a clock that started at a given monotonic
    time. A PDU link that could not be opened is closed, and a new one is made for the next try. If
    `notices_replug`, a PDU link that refused its settings is retried without a request. `progress`
    returns a text while something takes long, else an empty one.
    """

    def __init__(
        self, setup: Setup, make: Make, notices_replug: bool, progress: Callable[[], str]
    ) -> None:
        self._setup = setup
        self._make = make
        self._notices_replug = notices_replug
        self._progress = progress
        self._told_to = asyncio.Event()
        self._patience = Patience.NONE
        self._knows_when = True
        self.state = "opening"
        self.reason = BEING_OPENED
        self._told_state, self._told_since = "", 0.0
        self.pdu_link = make(setup, Patience.NONE, time.monotonic())

    @property
    def config(self) -> Config:
        """The configuration with which the PDU link is opened."""
        return self._setup.config

    @property
    def is_up(self) -> bool:
        """Whether the PDU link was opened and has not refused since."""
        return self.state == "up"

    @property
    def is_working(self) -> bool:
        """Whether the PDU link carries PDUs now."""
        return self.is_up and self.pdu_link.report().state != "down"

    async def until_up(self, listener: PduListener) -> Carry:
        """Try until the PDU link is open, and return its function that carries PDUs.

        Raises UserError if the first try fails in a way that only a person can fix.
        """
        wait_s, most_s = RETRY_S
        if self.state == "waiting":
            # What ends soon after it was opened is not opened again and again.
            await self._pause(wait_s)
        while True:
            is_first = self._patience is Patience.NONE
            if self._told_to.is_set():
                # What was found out meanwhile concerns the old settings.
                self._patience = Patience.THERE
                self._told_to.clear()
            try:
                if not is_first:
                    await self._renew()
                carry = await self._unless_told(self.pdu_link.open(listener))
            except LinkAbsentError as error:
                self._wait("waiting", str(error), Patience.THERE, knows_when=True)
            except LinkRefusedError as error:
                self.refused(str(error))
            except UserError as error:
                if is_first:
                    raise
                # The daemon already runs with this configuration, so do not end it.
                self._wait("refused", str(error), Patience.THERE, knows_when=False)
            else:
                # If a retry was requested in the same moment, the open link has the old settings.
                if carry is not None and not self._told_to.is_set():
                    self.state, self.reason = "up", ""
                    return carry
                continue
            await self._pause(wait_s if self._knows_when else None)
            wait_s = min(2 * wait_s, most_s)

    async def run(self, carry: Carry) -> None:
        """Run the PDU link until it is gone, refuses its settings, or a retry is requested."""
        try:
            await self._unless_told(carry())
        except LinkAbsentError as error:
            self._wait("waiting", str(error), Patience.THERE, knows_when=True)
        except LinkRefusedError as error:
            self.refused(str(error))

    def refused(self, reason: str) -> None:
        """Wait for another try, as the PDU link refuses its settings."""
        self._wait("refused", reason, Patience.REPLUGGED, self._notices_replug)

    def try_again(self, setup: Setup) -> None:
        """Try at once with the configuration of `setup`, as a person requested it."""
        self._setup = setup
        # A person expects the device to be present or to appear.
        self._wait("opening", BEING_OPENED, Patience.THERE, knows_when=True)
        self._told_to.set()

    def report(self, at: float) -> PduLinkReport:
        """The PDU link's report, with the state while it is not up, at monotonic time `at`."""
        told = self.pdu_link.report()
        if not self.is_up:
            # A waiting attempt may know more by now.
            latest = told.reason if self.state == "waiting" else ""
            reason = self._progress() or latest or self.reason
            told = replace(told, state=self.state, reason=reason, notices=[])
        if told.state != self._told_state:
            self._told_state, self._told_since = told.state, at
        return replace(told, since_s=at - self._told_since)

    async def close(self) -> None:
        """Close the PDU link, whatever its state."""
        await self.pdu_link.close()

    async def _renew(self) -> None:
        """Replace the PDU link with a new one, whose clock continues the old one's time."""
        began_s = time.monotonic() - self.pdu_link.now()
        await self.pdu_link.close()
        self.pdu_link = self._make(self._setup, self._patience, began_s)

    async def _pause(self, at_most_s: float | None) -> None:
        """Wait until a retry is requested, or for `at_most_s`."""
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(at_most_s):
                await self._told_to.wait()

    def _wait(self, state: str, reason: str, patience: Patience, knows_when: bool) -> None:
        self.state, self.reason = state, reason
        self._patience, self._knows_when = patience, knows_when

    async def _unless_told(self, work: Coroutine[object, object, T]) -> T | None:
        """Do `work`; returns None if a retry is requested meanwhile. Raises what `work` raises."""
        working = asyncio.ensure_future(work)
        told = asyncio.ensure_future(self._told_to.wait())
        try:
            await asyncio.wait((working, told), return_when=asyncio.FIRST_COMPLETED)
        finally:
            told.cancel()
            # Wait for its end, so that it cannot interfere with the next attempt.
            if not working.done():
                working.cancel()
                await asyncio.wait((working,))
        return None if working.cancelled() else working.result()
