"""Brings up what carries the PDUs, and goes on trying: a radio may come late, or not take what the
configuration asks of it.
"""

import asyncio
import contextlib
from collections.abc import Callable

from msgspec.structs import replace

from backends import Patience
from sdrlinkd.config import Config, Setup
from sdrlinkd.errors import LinkAbsentError, LinkRefusedError
from sdrlinkd.pdulink import PduLink, PduListener
from sdrlinkd.reports import CarrierReport

RETRY_S = 0.25, 2.0
"""What is not there is tried again after so long; more each time."""
BEING_OPENED = "it is being opened"

Make = Callable[[Setup, Patience], PduLink]


class Opening:
    """Owns the PDU link while it is not up, and `state` and `reason` of that time.

    `make` builds one from a configuration; what could not be opened is closed, and another one is
    made for the next try. A PDU link that `notices_replug` is tried again without being told to
    after its settings were refused. `progress` says what takes so long, where something does.
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
        self.state = "opening"
        self.reason = BEING_OPENED
        self._told_state, self._told_since = "", 0.0
        self.pdu_link = make(setup, Patience.NONE)

    @property
    def config(self) -> Config:
        """What it is opened with."""
        return self._setup.config

    @property
    def is_up(self) -> bool:
        """Whether it carries PDUs, or did when last heard of."""
        return self.state == "up"

    async def until_up(self, listener: PduListener) -> None:
        """Try until it is there. Raises UserError when a person has to mend something first."""
        wait_s, most_s = RETRY_S
        while not self.is_up:
            if self._patience is not Patience.NONE:
                await self.pdu_link.close()
                self.pdu_link = self._make(self._setup, self._patience)
            self._told_to.clear()
            if await self._try(listener) or self._told_to.is_set():
                continue
            with contextlib.suppress(TimeoutError):
                knows_when = self.state == "waiting" or self._notices_replug
                async with asyncio.timeout(wait_s if knows_when else None):
                    await self._told_to.wait()
            wait_s = min(2 * wait_s, most_s)

    def refused(self, reason: str) -> None:
        """What was up will not have us any more."""
        self.state, self.reason = "refused", reason
        self._patience = Patience.REPLUGGED

    def try_again(self, setup: Setup) -> None:
        """A person says that it may succeed now, with this configuration."""
        if self.is_up:
            return
        self._setup = setup
        # Whatever it is, it is there now or can be waited for.
        self._patience = Patience.THERE
        self._told_to.set()

    def report(self, at: float) -> CarrierReport:
        """What the PDU link tells, or why there is none; since when, on the clock of `at`."""
        told = self.pdu_link.report()
        if not self.is_up:
            reason = self._progress() or self.reason
            told = replace(told, state=self.state, reason=reason, notices=[])
        if told.state != self._told_state:
            self._told_state, self._told_since = told.state, at
        return replace(told, since_s=at - self._told_since)

    async def close(self) -> None:
        """Close what there is."""
        await self.pdu_link.close()

    async def _try(self, listener: PduListener) -> bool:
        """Open it, or give up when told to try again."""
        opening = asyncio.ensure_future(self.pdu_link.open(listener))
        told = asyncio.ensure_future(self._told_to.wait())
        try:
            await asyncio.wait((opening, told), return_when=asyncio.FIRST_COMPLETED)
            if not opening.done():
                return False
            opening.result()
        except LinkAbsentError as error:
            self.state, self.reason = "waiting", str(error)
            self._patience = Patience.THERE
            return False
        except LinkRefusedError as error:
            self.refused(str(error))
            return False
        finally:
            for each in (opening, told):
                each.cancel()
        self.state, self.reason = "up", ""
        return True
