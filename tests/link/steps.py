"""Links that hear each other in time steps, without an air in between."""

from sdrlinkd.link import Outcome


class Steps:
    """Links by robot. In each step all do what is due and send, then all hear the arrivals.

    `next_burst(link, now)` is called up to `most_bursts` times per step. Subclasses override
    `arrivals`, which says what arrives of a burst.
    """

    def __init__(self, links, step_s, next_burst, most_bursts=1000):
        self.links = links
        self.now = 0.0
        self.bursts = []
        """All bursts as (time of the request, sender, burst)."""
        self._step_s = step_s
        self.next_burst = next_burst
        self._most_bursts = most_bursts
        self._under_way = []

    def arrivals(self, to, src, burst):
        """What this robot receives of a burst: (s after the burst's start, SNR, PDU)."""
        raise NotImplementedError

    def confirmed_s(self):
        """How long after its start a burst is reported as sent."""
        return 0.0

    def order(self, due):
        """The arrivals of a step, in the order in which they are heard."""
        return due

    def take(self, robot, message):
        """Deliver a message to a robot's programs."""

    def run(self, until, each_step=lambda steps: None):
        while self.now < until:
            each_step(self)
            self.step()

    def step(self):
        self.now += self._step_s
        for robot, link in self.links.items():
            link.handle_timers(self.now)
            for _ in range(self._most_bursts):
                burst = self.next_burst(link, self.now)
                if burst is None:
                    break
                self._send(robot, link, burst)
        due = [each for each in self._under_way if each[0] <= self.now]
        self._under_way = [each for each in self._under_way if each[0] > self.now]
        for _, at, robot, snr_db, pdu in self.order(due):
            for message in self.links[robot].hear(pdu, at, snr_db, self.now):
                self.take(robot, message)
        assert [line for link in self.links.values() for line in link.audit()] == []

    def _send(self, src, link, burst):
        self.bursts.append((self.now, src, burst))
        link.confirm(burst, Outcome.SENT, burst.start + self.confirmed_s())
        for robot in self.links:
            if robot != src:
                for delay_s, snr_db, pdu in self.arrivals(robot, src, burst):
                    arrival = (burst.start + delay_s, burst.start, robot, snr_db, pdu)
                    self._under_way.append(arrival)
