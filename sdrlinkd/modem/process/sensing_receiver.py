"""Feeds the receiver and the energy detector block by block, behind the excisor."""

from collections import Counter
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

import phy
from backends import SENDING, RxBlock
from sdrlinkd.link import Sensed
from sdrlinkd.modem.process.observer import Observer
from sdrlinkd.pdulink import LineSeen

# The energy of a burst may seem to end later than its header says, by this many samples.
TAIL = 2 * phy.SENSE_WINDOW
# A burst whose SNR is this far above the threshold shows as energy in every window, ...
CLEARLY_DB = 3.0
# ... so after this many samples without energy, it is over, whatever its header said.
VANISHED = 4 * phy.SENSE_WINDOW
PATIENCE_S = 0.04
"""Energy that no header explains becomes noise after this: a robot beside a jammer sends again."""


class SensingReceiver:
    """Turns samples into events and the state of the channel; `hear` is for one thread only."""

    def __init__(
        self, receiver: "phy.Receiver", sense: "phy.EnergyDetector | None", rate_hz: float
    ) -> None:
        self._receiver = receiver
        self._sense = sense
        self._excisor = phy.Excisor()
        receiver.cuts = self._excisor.cuts
        self._rate_hz = rate_hz
        self._unheard_until = 0
        self.observer: Observer | None = None
        """Looks at what comes; may be changed from any thread."""
        self.sensed = Sensed() if sense is None else Sensed(until=0.0)
        """State of the channel after the last block; may be read from any thread."""

    def hear(self, block: RxBlock) -> Sequence[phy.Event]:
        """Take a block, and return the events that it completes."""
        if block.samples is None:
            events = self._take(self._excisor.gap(block.n)) + self._receiver.gap(block.n)
            if self._sense is not None:
                self._sense.gap(block.n)
                if block.gap_reason != SENDING:
                    # A burst that started in this gap may still be on the air.
                    self._unheard_until = block.index + block.n
        else:
            events = self._take(self._excisor.push(block.samples))
        if self._sense is not None:
            self.sensed = self._sense_air(self._sense)
        if (observer := self.observer) is not None:
            observer.take(block, events)
        return events

    def flush(self) -> Sequence[phy.Event]:
        """End the stream, and return the events of its last samples."""
        return self._take(self._excisor.flush()) + self._receiver.flush()

    @property
    def next_index(self) -> int:
        """The index after the last sample heard."""
        return self._excisor.next_index

    @property
    def lines(self) -> list[LineSeen]:
        """What is cut out of the samples now; may be read from any thread."""
        noise_dbfs = None if self._sense is None else self._sense.noise_dbfs
        return [
            LineSeen(
                line.frequency * self._rate_hz,
                line.power_dbfs,
                None if noise_dbfs is None else line.power_dbfs - noise_dbfs,
                line.width,
                line.moves,
            )
            for line in self._excisor.lines
        ]

    @property
    def counters(self) -> Counter[str]:
        """The counters of receiver and excisor."""
        return self._receiver.counters + self._excisor.counters

    def _take(self, samples: NDArray[np.complex64]) -> list[phy.Event]:
        """Give samples without lines to the receiver and the energy detector."""
        events = self._receiver.push(samples)
        if self._sense is not None:
            self._sense.explain(self._receiver.claim.end)
            self._sense.push(samples)
        return events

    def _sense_air(self, sense: "phy.EnergyDetector") -> Sensed:
        sensed = self._sense_energy(sense, sense.busy_until)
        if sense.carrier_until == sense.busy_until:
            end, at = sensed.idle_since, sensed.burst_at
        else:
            _, end, at, *_ = self._sense_energy(sense, sense.carrier_until)
        rate = self._rate_hz
        pulses = tuple(each / rate for each in sense.pulses(end * rate))
        return sensed._replace(carrier_end=end, carrier_at=at, pulses=pulses)

    def _sense_energy(self, sense: "phy.EnergyDetector", energy_end: int) -> Sensed:
        """The state of the channel if energy was detected until `energy_end`."""
        rate, until = self._rate_hz, sense.next_index
        begin, end, snr_db = self._receiver.claim
        burst_at: float | None = begin / rate
        if energy_end + VANISHED <= until and energy_end > begin + TAIL:
            # False headers claim air that nobody uses.
            shows = snr_db >= sense.threshold_db + CLEARLY_DB
            end = min(end, energy_end) if shows else end
        if self._unheard_until > max(end, energy_end):
            return Sensed(until / rate, (self._unheard_until + 1) / rate)
        if energy_end > end + TAIL:
            end, burst_at = energy_end, None
            if energy_end + TAIL > until:
                # The energy may continue, so the channel counts as busy.
                end = until + 1
        return Sensed(until / rate, end / rate, burst_at)
