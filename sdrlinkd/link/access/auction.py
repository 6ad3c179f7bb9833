"""`auction`: the most urgent message of all robots that hear each other goes next.

Each burst tells what its sender wants next (WANT). So after a burst, all know who is next. The
first mini-slot is for a challenge: a pulse of energy, by whoever has something more urgent than
what is known. If nobody challenges, the robot that is next sends in the second mini-slot. After a
challenge, those that challenged find out by pulses who of them is first (`contest`). So a quiet
hand-over takes two mini-slots, whatever the number of robots.

All that is decided follows from when the last burst ended, what was told until then, and which
pulses came since. If nothing comes, a new round begins, in which everybody may challenge.
"""

from collections.abc import Sequence
from math import inf

from sdrlinkd.link.access.base import NEVER, BusyChannel, Slot, Wish
from sdrlinkd.link.access.by_auction import ByAuction
from sdrlinkd.link.access.contest import Contest, n_bits
from sdrlinkd.link.access.disturbance import Disturbance
from sdrlinkd.link.access.known_wants import KnownWants
from sdrlinkd.link.access.mini_rounds import QUIET, MiniRounds, Place, is_near
from sdrlinkd.link.access.own_slots import OwnSlots
from sdrlinkd.link.access.requests import Waiting, waiting_of
from sdrlinkd.link.access.sightings import Sightings
from sdrlinkd.link.qos import Qos
from sdrlinkd.link.traits import Sensed
from sdrlinkd.wire import WANT_SIZE, Want

PATIENCE = 8
"""Bursts of others after which a robot that could not tell what it wants challenges, and wins
against those that have not waited for so long."""
STARVED = 200
"""Bursts of others after which a robot challenges whatever it has, unless something urgent is next,
and takes part in the contest with class latency at least."""
MUTE = 20
"""Bursts in sequence without a WANT from which a robot takes no part. Repeats have none."""
PAUSE_S = 0.05
"""Time in s without a query after which a robot had nothing to send meanwhile."""


class Auction(BusyChannel):
    """Access by known requests, challenges and contests, among robots that all hear each other.

    A mini-slot lasts `minislot_s`; a pulse is known `detect_s` after it began, less the reaction
    time of the radio.
    """

    others_follow = True
    least_room = WANT_SIZE + 32
    """For a WANT, and for a part of a message."""

    def __init__(
        self, own_id: int, nodes: Sequence[int], minislot_s: float, detect_s: float
    ) -> None:
        super().__init__()
        self._own_id = own_id
        self._nodes = list(nodes)
        self._rank = self._nodes.index(own_id)
        self._minislot_s = minislot_s
        self._detect_s = detect_s
        self._n_bits = n_bits(len(nodes))
        self.pause_s = QUIET * minislot_s
        self.round_s = (QUIET + self._n_bits) * minislot_s
        self._wants = KnownWants(own_id, nodes)
        self._told_at = NEVER
        """When the last burst of another robot began that told what it wants."""
        self._looked_at = -inf
        """The end of the last burst of others that we have looked at."""
        self._rounds = MiniRounds(minislot_s, self._n_bits)
        self._slots = OwnSlots(minislot_s, 2 * len(nodes))
        """Those for robots that are sure of the order, and then those for all others."""
        self._pulses: list[float] = []
        """When our last pulses began."""
        self._contest: tuple[float, Contest] | None = None
        """Our part in a contest, and the begin of its round."""
        self._disturbance = Disturbance()
        self._is_disturbed = False
        self._mute = Sightings()
        """Robots whose bursts do not tell what they want."""
        self._seen_bursts = 0
        """The count of bursts when we last looked."""
        self._asked = 0, 0.0
        """Since when we want to send, as (count of bursts then, time of the last query)."""
        self._before = self._asked, -inf
        """That, and when we were on the air, before our last burst."""

    @property
    def by_auction(self) -> ByAuction:  # type: ignore[override]
        """This policy."""
        return self

    @property
    def state(self) -> str:
        """Policy, robots and times, for people."""
        text = (
            f"auction: {len(self._nodes)} robots, mini-slots of {self._minislot_s * 1e3:.3g} ms, "
            f"contest in {self.round_s * 1e3:.3g} ms"
        )
        return text + "; turns without pulses, as something disturbs them" * self._is_disturbed

    @property
    def lacks(self) -> str:  # type: ignore[override]
        """A quiet air, if something disturbs the pulses."""
        return "an air without other pulses" if self._is_disturbed else ""

    def mean_wait_s(self, qos: Qos) -> float:
        """Mean wait in s: a quiet hand-over."""
        return self.pause_s

    def carries(self, burst_s: float) -> float:
        """Share of airtime of bursts after quiet hand-overs."""
        return burst_s / (burst_s + self.pause_s)

    def slot(self, wish: Wish) -> Slot | None:
        """The next mini-slot for a burst or pulse of ours, once all before it are known."""
        earliest, sensed = wish.earliest, wish.sensed
        carrier_end = max(sensed.carrier_end, self.own_end)
        if max(carrier_end, sensed.idle_since) > sensed.until:
            return None
        self._look(sensed)
        if earliest > self._asked[1] + PAUSE_S:
            self._asked = self._wants.n_bursts, earliest
        self._asked = self._asked[0], earliest
        self._is_disturbed = self._disturbance.lasts(earliest)
        if self._is_disturbed:
            return self._in_turn(wish, carrier_end)
        rounds = self._rounds
        has_seen = rounds.knows(carrier_end)
        place = rounds.place(carrier_end, earliest, (*sensed.pulses, *self._pulses))
        drift_s = (place.width_s - self._minislot_s) / 2
        if place.start > sensed.until + place.width_s - drift_s - self._detect_s:
            return None
        n_unseen = self._wants.n_bursts - self._seen_bursts
        self._seen_bursts = self._wants.n_bursts
        if n_unseen > 1 or (not has_seen and place.n_before):
            # We may have been next in a hand-over that has passed.
            self._wants.told(self._own_id, None, earliest)
        if rounds.go_on(place, carrier_end):
            self._nobody_came(place.begin, carrier_end)
        self._disturbance.count(place.fruitless, place.start)
        if place.number == 0:
            return self._challenge(wish, place)
        if not place.is_contested:
            return self._burst(wish, place.start) if self._is_next(wish, place) else None
        return self._in_contest(wish, place, sensed.pulses)

    def told(self, waiting: Waiting | None, start: float) -> None:
        """Note what our burst at `start` tells; None: that we want nothing more."""
        self._wants.told(self._own_id, waiting, start)

    def take_want(self, src: int, want: Want, at: float) -> None:
        """Take what a robot told in a burst at `at`; nobody speaks for others here."""
        if want.node == src:
            self._wants.told(src, waiting_of(want), at)
            self._told_at = max(self._told_at, at)
            self._mute.clear(src)

    def sent(self, end: float, src: int | None) -> None:
        """Remember our own burst, which we do not hear."""
        super().sent(end, src)
        # Told by its end, as its begin is not known; no other burst is in between.
        self._before = self._asked, self._wants.silent_since(self._own_id)
        self._wants.on_air(self._own_id, end)
        self._contest = None
        self._disturbance.burst()
        self._asked = self._wants.n_bursts, end

    def not_sent(self, start: float) -> None:
        """Take no part in a contest of which a pulse of ours did not leave."""
        if start in self._pulses:
            self._pulses.remove(start)
            self._contest = None
        else:
            super().not_sent(start)
            # The others have heard nothing, and may have given us up.
            self._asked, silent_since = self._before
            self._wants.take_back(self._own_id, silent_since)

    def heard(self, src: int, at: float, is_relayed: bool, *, is_weak: bool = False) -> None:
        """Remember who was on the air."""
        if not is_relayed and self._wants.on_air(src, at):
            self._mute.add(src, at)

    def notices(self, now: float) -> list[str]:
        """Sentences on robots that use another access policy, or always want urgent."""
        mute = [
            f"robot {src} takes no part in the auction and this robot does: their bursts collide; "
            "give both the same [access]"
            for src in self._mute.lately(now, MUTE)
        ]
        return super().notices(now) + mute + self._wants.urgent.notices(now)

    def _look(self, sensed: Sensed) -> None:
        """Note what has ended since the last time: a burst that told something, or not."""
        end = sensed.carrier_end
        if end <= self._looked_at:
            return
        self._looked_at = end
        self._disturbance.burst()
        if sensed.carrier_at != self._told_at:
            self._wants.missed(end)

    def _nobody_came(self, now: float, since: float) -> None:
        """Forget what the robot wants that was to send next, as it did not.

        If we have missed a burst, that may be what we want.
        """
        wants = self._wants
        first = wants.first(since)
        if wants.is_unsure(self._own_id, now):
            wants.told(self._own_id, None, now)
        elif first is not None:
            wants.told(first.node, None, now)

    def _challenge(self, wish: Wish, place: Place) -> Slot | None:
        """A pulse in the first mini-slot of a round, if we have reason for it."""
        if not self._challenges(wish, place):
            return None
        qos = min(wish.qos, Qos.LATENCY) if self._has_waited(STARVED) else wish.qos
        waited = self._has_waited(PATIENCE)
        self._contest = place.begin, Contest(qos, self._rank, len(self._nodes), has_waited=waited)
        # Who is next anyway sends, unless somebody else challenges.
        return None if self._is_next(wish, place) else self._pulse(place.start)

    def _is_next(self, wish: Wish, place: Place) -> bool:
        """Whether everybody knows that we are next, unless somebody challenges."""
        first = self._wants.first(place.idle_since) if place.is_first else None
        is_known = first is not None and first.node == self._own_id
        return is_known and not self._wants.is_unsure(self._own_id, wish.earliest)

    def _challenges(self, wish: Wish, place: Place) -> bool:
        wants, since = self._wants, place.idle_since
        priority = 0 if wish.waiting is None else wish.waiting.priority
        first = wants.first(since) if place.is_first else None
        if first is None or not first.is_before(wish.qos, priority):
            return True
        if first.node == self._own_id:
            return wants.is_unsure(self._own_id, wish.earliest)
        if first.qos > Qos.URGENT and self._has_waited(STARVED):
            return True
        is_unknown = wants.lacks(self._own_id, wish.qos, priority, since)
        is_long = self._has_waited(PATIENCE) or wants.goes_again(first, priority, self._asked[0])
        return wish.qos <= first.qos and is_unknown and is_long

    def _in_contest(self, wish: Wish, place: Place, pulses: Sequence[float]) -> Slot | None:
        """What we do in a round with a challenge."""
        if self._contest is None or abs(self._contest[0] - place.begin) > place.width_s / 2:
            return None
        contest = self._contest[1]
        for bit in range(place.number - 1):
            at = place.at(1 + bit)
            if is_near(at, place.width_s, pulses):
                contest.heard(bit)
            if contest.pulses(bit) and not is_near(at, place.width_s, self._pulses):
                # We have missed that mini-slot, so the others know nothing of us.
                contest.is_in = False
        if place.number <= self._n_bits:
            return self._pulse(place.start) if contest.pulses(place.number - 1) else None
        if not contest.is_in:
            return None
        return self._burst(wish, place.start)

    def _has_waited(self, n_bursts: int) -> bool:
        return self._wants.n_bursts >= self._asked[0] + n_bursts

    def _burst(self, wish: Wish, start: float) -> Slot:
        # What comes with the first message is not less urgent, or others should have the air.
        return Slot.exact(start, least=max(Qos.LATENCY, wish.qos))

    def _pulse(self, start: float) -> Slot | None:
        if start in self._pulses:
            return None
        self._pulses = [*self._pulses[-self._n_bits :], start]
        return Slot.exact(start)._replace(is_pulse=True)

    def _in_turn(self, wish: Wish, idle_since: float) -> Slot | None:
        """Without pulses: a mini-slot for each robot, in the order in which they were silent."""
        number = self._wants.in_order().index(self._own_id)
        if self._wants.is_unsure(self._own_id, wish.earliest):
            number = len(self._nodes) + self._rank
        # Here, a pulse is a carrier like any other.
        idle_since = max(idle_since, wish.sensed.idle_since)
        own = self._slots.next(number, idle_since, wish.earliest)
        if not own.is_known(wish.sensed.until, self._detect_s):
            return None
        return self._burst(wish, max(own.start, wish.earliest))
