"""Messages of robots on their way to Zenoh, and the last ones for later."""

from collections.abc import Callable, Iterator
from math import inf

import msgspec

from sdrlinkd.client import Message
from sdrlinkd.fleet.formats import Passed, encode, read_passed
from sdrlinkd.fleet.forwarding import Turn
from sdrlinkd.fleet.heard_robot import HeardRobot, Upward
from sdrlinkd.fleet.keys import Keys, TopicKey
from sdrlinkd.fleet.last_values import LastValues
from sdrlinkd.fleet.report import Counts
from sdrlinkd.fleet.samples import Answer, Sample
from sdrlinkd.fleet.session import Session
from sdrlinkd.fleet.topics import matches

SETTLED_S = 0.7
"""Time in s after which whoever reaches the network again has found its way in it."""

_NOT_PUT = {Turn.LATER: "up_held", Turn.OTHERS: "up_left", Turn.PAST: "up_repeated"}


class UpwardMessages:
    """Puts the messages of heard robots; times in s of one monotonic clock.

    `patterns`: the topics that are put; none: all. `class_of` gives the class of a topic.
    """

    def __init__(
        self, own_id: int, keys: Keys, patterns: list[str], session: Session, counts: Counts,
        class_of: Callable[[str], str],
    ) -> None:  # fmt: skip
        self._own_id = own_id
        self._keys = keys
        self._patterns = patterns
        self._session = session
        self._counts = counts
        self._class_of = class_of
        self._last = LastValues()
        self._missed: set[str] = set()
        """Keys whose last message may not have come to anybody, as the network was away."""
        self._settled_at = -inf
        self.on_put: Callable[[TopicKey, Upward], None] | None = None
        """Called with each message once, at the gateway that leads; at any where none does."""

    def take(self, robot: HeardRobot, topic: str, message: Message, now: float) -> None:
        """Take a message of a robot from the bus."""
        self._counts.add("up_taken")
        if self._patterns and not matches(topic, self._patterns):
            self._counts.add("up_not_selected")
            return
        key, qos = self._keys.message(robot.id, topic), self._class_of(topic)
        item = Upward(key, message.payload, _passed(self._own_id, message), qos, now)
        if not message.is_stop:
            self._last.keep(key, item.payload, item.passed, now)
        if now < self._settled_at:
            self._missed.add(key)
        if not self._session.is_reached:
            self._settled_at = inf
            self._missed.add(key)
            self._counts.add("up_away")
            self._pass_on(robot, item)
            return
        turn = robot.forwarding.heard(
            (key, message.series), message.name, item, now, leads=robot.election.leads
        )
        if turn is Turn.OURS:
            self._put(robot, item, now)
        else:
            self._counts.add(_NOT_PUT[turn])

    def leave_bridged(self) -> None:
        """Leave a message of a robot on another air, which a gateway has sent, to its gateway."""
        self._counts.add("up_taken")
        self._counts.add("up_bridged")

    def passed(self, robot: HeardRobot, sample: Sample, now: float) -> None:
        """Note that another gateway has put a message of a robot."""
        passed = read_passed(sample.attachment)
        if passed is None or passed.gw == self._own_id:
            return
        kept = self._last.get(sample.key) if sample.key in self._missed else None
        if kept is not None and passed.name is not None and kept[1].name == passed.name:
            self._missed.discard(sample.key)
        if self.on_put is not None and self._is_first(robot, passed, sample.key, now):
            told = self._keys.read_message(sample.key)
            if told is not None:
                qos = self._class_of(told.topic)
                self.on_put(told, Upward(sample.key, sample.payload, passed, qos, now))
        is_led = passed.gw == robot.election.leader
        key = sample.key, passed.sr
        if robot.forwarding.passed(key, passed.name, now, by_leader=is_led):
            self._counts.move("up_held", "up_left")

    def put_due(self, robot: HeardRobot, now: float, *, all_held: bool = False) -> None:
        """Put what was held for long enough, or, as this gateway leads from now on, all of it."""
        due = robot.forwarding.lead() if all_held else robot.forwarding.due(now)
        self._counts.add("up_held", -len(due))
        for item in due:
            self._put(robot, item, now)

    def reach(self, now: float) -> None:
        """Note that the network is there again; others may need SETTLED_S to find it, too."""
        self._settled_at = now + SETTLED_S

    def put_again(self, robots: set[int], now: float) -> None:
        """Put the last messages of `robots` that may not have come to anybody."""
        for key in sorted(self._missed):
            robot, kept = self._keys.read_message(key), self._last.get(key)
            if robot is not None and robot.robot in robots and kept is not None:
                payload, passed, at = kept
                aged = _aged(passed, now - at, again=True)
                self._counts.add("up_again", self._session.put(key, payload, encode(aged), "bulk"))
                self._missed.discard(key)

    def last_items(self, robot: int, now: float) -> Iterator[tuple[TopicKey, Upward]]:
        """The last message of each topic of a robot, to be put."""
        for key in self._last.keys_at(self._keys.message(robot, "") + "/"):
            told, kept = self._keys.read_message(key), self._last.get(key)
            if told is not None and kept is not None:
                payload, passed, at = kept
                qos = self._class_of(told.topic)
                yield told, Upward(key, payload, _aged(passed, now - at), qos, now)

    def answers(self, robot: int, now: float) -> Iterator[Answer]:
        """The last message of each topic of a robot."""
        prefix = self._keys.message(robot, "") + "/"
        for key in self._last.keys_at(prefix):
            kept = self._last.get(key)
            if kept is not None:
                payload, passed, at = kept
                yield Answer(key, payload, encode(_aged(passed, now - at, again=True)))

    def _is_first(self, robot: HeardRobot, passed: Passed, key: str, now: float) -> bool:
        """Whether this gateway leads, and has not had a message that another one puts."""
        if not robot.election.leads or passed.again or passed.name is None:
            return False
        return not robot.forwarding.is_known((key, passed.sr), passed.name, now)

    def _put(self, robot: HeardRobot, item: Upward, now: float) -> None:
        if not self._session.is_reached:
            # It was held when the network went away.
            self._missed.add(item.key)
            self._counts.add("up_away")
            return
        attachment = encode(_aged(item.passed, now - item.at))
        is_put = self._session.put(item.key, item.payload, attachment, item.qos)
        self._counts.add("up_put" if is_put else "up_overflow")
        self._pass_on(robot, item)

    def _pass_on(self, robot: HeardRobot, item: Upward) -> None:
        is_ours = robot.election.leads or robot.election.leader is None
        if self.on_put is not None and is_ours and (told := self._keys.read_message(item.key)):
            self.on_put(told, item)


def _passed(own_id: int, message: Message) -> Passed:
    """The attachment of a message, with its age as the daemon handed it over."""
    told = Passed(
        gw=own_id, ty=message.type, sr=message.series, age=message.age_us, sn=message.snr_db,
        tl=message.published_ns, eb=message.published_error_us, h=message.hops_left,
        stop=message.is_stop, again=message.is_late,
    )  # fmt: skip
    name = message.name
    if name is None:
        return told
    return msgspec.structs.replace(
        told, b=name.boot_id, e=name.entry_id, ps=name.more_pdus,
        pn=name.first_pdu if name.is_numbered else None,
        sq=None if name.is_numbered else name.first_pdu,
    )  # fmt: skip


def _aged(passed: Passed, by_s: float, *, again: bool = False) -> Passed:
    """The attachment of a message that has grown older since the daemon handed it over."""
    age = None if passed.age is None else passed.age + round(1e6 * by_s)
    return msgspec.structs.replace(passed, age=age, again=again or passed.again)
