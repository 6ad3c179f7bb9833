"""Two robots, and the clocks of both."""

from random import Random

from sdrlinkd.link import ClockParams
from sdrlinkd.link.timesync import Clocks

SEED = 3
PERIOD_S = 0.2
DELAY_S = 2e-6


class Pair:
    """Two robots with different clocks; both CLOCKs of a period are exchanged."""

    def __init__(self, offset_s=7.0, skew=2e-5, delay_s=DELAY_S, seed=SEED, boot_id=0xB, **params):
        self.offset_s, self.skew, self.delay_s = offset_s, skew, delay_s
        self.rng = Random(seed)
        self.one = Clocks(ClockParams(**params), 0xA, 1)
        self.two = Clocks(ClockParams(**params), boot_id, 2)
        for clocks in (self.one, self.two):
            clocks.set_resolution(1e-6)
        self.at = 10.0
        """Current time by the clock of robot 1."""
        self.sent = []
        """What robot 2 has sent, and its arrival times at robot 1."""

    def there(self, at):
        """Time by the clock of robot 2: one − two = offset + skew * t."""
        return at - self.offset_s - self.skew * at

    def period(self, lost=0.0):
        at = self.at = self.at + PERIOD_S
        if (record := self._send(self.one, at, lost)) is not None:
            self.two.hear(1, record, self.there(at + self.delay_s))
        at = self.at + 0.05
        if (record := self._send(self.two, self.there(at), lost)) is not None:
            self.sent.append((record, at + self.delay_s))
            self.one.hear(2, record, at + self.delay_s)

    def _send(self, clocks, at, lost):
        record = clocks.record(at, 10)
        clocks.left(clocks.rode(), at)
        return None if self.rng.random() < lost else record

    def run(self, periods, lost=0.0):
        for _ in range(periods):
            self.period(lost)

    def error_s(self):
        now = self.at + 0.1
        return self.one.peers[2].estimate(now).offset(now) - self.offset_s - self.skew * now
