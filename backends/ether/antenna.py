"""One node's radio on a simulated air: makes blocks of what arrives, and tracks its bursts."""

import asyncio
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from backends.air import make_jammers
from backends.base import SENDING, Capabilities, RxBlock, TxBurst, TxOutcome, TxReport
from backends.ether import protocol
from backends.ether.ear import Piece
from backends.ether.medium import NOISE_DBFS
from backends.ether.world import RadioParams
from backends.outstanding import NEVER
from backends.params import JammerParams
from phy import FrontEnd, FrontEndParams

NOTHING_DB = 300.0


class Beside(NamedTuple):
    """What came together with a block; the event loop reads it together with that block."""

    placed: list[protocol.Placed]
    step: int
    welcome: protocol.Welcome | None = None


class Antenna:
    """Front end, sample count and outstanding bursts of one node; all reported indices are its own.

    Without time stamps, each gap shifts the radio's count a little, and with it all later indices.
    """

    def __init__(
        self, radio: RadioParams, seed: int, rate_hz: float, jammers: Sequence[JammerParams] = ()
    ) -> None:
        self._radio = radio
        self._jammers = make_jammers(jammers, NOISE_DBFS, rate_hz)
        self._index_error = 0 if radio.timestamps else round(radio.index_error_s * rate_hz)
        self._rng = np.random.Generator(np.random.SFC64(seed))
        front_end = FrontEndParams(
            noise_dbfs=NOISE_DBFS,
            image_db=np.inf if radio.image_db >= NOTHING_DB else radio.image_db,
            dc_dbfs=-np.inf if radio.dc_dbfs <= -NOTHING_DB else radio.dc_dbfs,
            bits=radio.adc_bits,
        )
        self._front_end = FrontEnd(front_end, self._rng)
        self._zeros = np.zeros(0, np.complex64)
        self._shift = 0
        self._is_unsure = False
        self._was_deaf = False
        self.next_index = 0
        self.end = 0
        self._waiting: dict[int, tuple[TxReport | None, asyncio.Future[TxReport]]] = {}
        self._first_end = NEVER

    def capabilities(self, paced: bool, lead_s: float, block_s: float) -> Capabilities:
        """What the radio can do on an air that is `paced` or else in lock-step."""
        radio = self._radio
        return Capabilities(
            receives=True,
            transmits=True,
            full_duplex=radio.full_duplex,
            timestamps=radio.timestamps,
            paced=paced,
            lockstep=not paced,
            lead_s=lead_s,
            block_s=block_s,
            turnaround_s=0.0 if radio.full_duplex else radio.turnaround_s,
            index_error_s=0.0 if radio.timestamps else radio.index_error_s,
        )

    def on_air(self, burst: TxBurst) -> TxBurst:
        """One of this radio's bursts, with indices in the air's sample count."""
        latest = None if burst.latest is None else burst.latest - self._shift
        return TxBurst(burst.start - self._shift, burst.samples, latest)

    def receive(self, piece: Piece, host_ns: int) -> RxBlock:
        """Convert the next piece of the air to the block that the radio delivers."""
        n, first = piece.n, self.next_index
        samples = None
        if piece.is_deaf:
            n += 0 if self._was_deaf else self._slip(n)
        else:
            if piece.samples is None and len(self._zeros) < n:
                self._zeros = np.zeros(n, np.complex64)
            heard = self._zeros[:n] if piece.samples is None else piece.samples
            for jammer in self._jammers:
                heard = jammer.add(heard, first - self._shift)
            samples = self._front_end.receive(heard)
        self._was_deaf = piece.is_deaf
        self.next_index = first + n
        return RxBlock(
            first,
            n,
            samples,
            "" if samples is not None else SENDING,
            host_ns,
            self._index_error if self._is_unsure else 0,
        )

    def miss(self, n: int, reason: str, host_ns: int) -> RxBlock:
        """A gap for `n` samples that were on the air but did not reach this radio."""
        first = self.next_index
        self.next_index += n
        uncertainty = self._index_error if self._is_unsure else 0
        return RxBlock(first, n, None, reason, host_ns, uncertainty)

    def rejoin(self, n: int, reason: str, host_ns: int) -> RxBlock:
        """A gap of about `n` samples, after which the air's count restarts at 0."""
        block = self.miss(n, reason, host_ns)
        self._shift = self.next_index
        return block

    def sent(self, number: int) -> asyncio.Future[TxReport]:
        """Register burst `number` as handed to the air; the report follows later."""
        answer: asyncio.Future[TxReport] = asyncio.get_running_loop().create_future()
        self._waiting[number] = (None, answer)
        return answer

    def placed(self, number: int, start: int | None, n_samples: int) -> bool:
        """Note where the air placed a burst, in the air's count; `start` None: it came too late.

        Returns whether the burst was just reported late.
        """
        _, answer = self._waiting.get(number, (None, None))
        if answer is None:
            return False
        if start is None:
            del self._waiting[number]
            if answer.done():
                return False
            answer.set_result(TxReport(TxOutcome.LATE, self.end, self.end))
            return True
        own = start + self._shift
        self._waiting[number] = (TxReport(TxOutcome.SENT, own, own + n_samples), answer)
        self._first_end = min(self._first_end, own + n_samples)
        return False

    def is_due(self, index: int) -> bool:
        """Whether `settle` would report a burst; may be called from any thread."""
        return self._first_end <= index

    def settle(self, index: int) -> None:
        """Report the bursts that ended before `index`: every sample before it has left."""
        self.end = index
        if not self.is_due(index):
            return
        for number, (report, answer) in list(self._waiting.items()):
            if report is not None and report.end <= index:
                del self._waiting[number]
                if not answer.done():
                    answer.set_result(report)
        ends = (report.end for report, _ in self._waiting.values() if report is not None)
        self._first_end = min(ends, default=NEVER)

    def lose(self) -> None:
        """Report all pending bursts as lost: none of them will leave."""
        waiting, self._waiting = self._waiting, {}
        for report, answer in waiting.values():
            if not answer.done():
                start, end = (self.end, self.end) if report is None else report[1:]
                answer.set_result(TxReport(TxOutcome.LOST, start, end))

    def _slip(self, n: int) -> int:
        if not self._index_error:
            return 0
        self._is_unsure = True
        slip = int(self._rng.integers(-self._index_error, self._index_error + 1))
        slip = max(slip, 1 - n)
        self._shift += slip
        return slip
