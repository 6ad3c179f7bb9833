"""Links that hear each other in steps of time, with no air between."""

from sdrlinkd.link import Outcome


class Steps:
    """Links by robot. In every step each does what is due and sends; then all hear what has come.

    `next_burst(link, now)` is asked up to `most_bursts` times a step. A world of its own overrides
    `arrivals`, which says what comes of a burst.
    """

    def __init__(self, links, step_s, next_burst, most_bursts=1000):
        self.links = links
        self.now = 0.0
        self.bursts = []
        """(when it was asked for, sender, burst) of all."""
        self._step_s = step_s
        self._next_burst = next_burst
        self._most_bursts = most_bursts
        self._under_way = []

    def arrivals(self, to, src, burst):
        """(s after the burst's start, SNR, PDU) of what this robot gets of it."""
        raise NotImplementedError

    def confirmed_s(self):
        """How long after its start a burst is told as sent."""
        return 0.0

    def order(self, due):
        """What has come in a step, in the order in which it is heard."""
        return due

    def take(self, robot, message):
        """A message for a robot's programs."""

    def run(self, until, each_step=lambda steps: None):
        while self.now < until:
            each_step(self)
            self.step()

    def step(self):
        self.now += self._step_s
        for robot, link in self.links.items():
            link.handle_timers(self.now)
            for _ in range(self._most_bursts):
                burst = self._next_burst(link, self.now)
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
