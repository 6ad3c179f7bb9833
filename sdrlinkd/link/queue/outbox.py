"""The queue of messages to be sent, and their order.

Levels are served in order. Within a level, topics share the airtime fairly (see `fair`); within a
topic, messages are sent in the order in which they came.
"""

from bisect import bisect_left, insort
from collections import OrderedDict
from collections.abc import Iterator
from math import inf

from sdrlinkd.link.params import QueueParams
from sdrlinkd.link.qos import Qos
from sdrlinkd.link.queue.fair import Level
from sdrlinkd.link.queue.lives import Lives
from sdrlinkd.link.queue.message import Lane, Outgoing, QueuedOfTopic
from sdrlinkd.link.queue.policy import TopicPolicy
from sdrlinkd.wire import ENTRY_HEADER_SIZE, STAMP_SIZE

MESSAGE_OVERHEAD = ENTRY_HEADER_SIZE + STAMP_SIZE
"""Bytes that a message takes in addition, as the last or only entry of a PDU that it shares."""


class Outbox:
    """The queue of one node, which sends PDUs of `pdu_size` bytes.

    The cost of an operation does not depend on the queue's length. In a queue that overflows, it
    depends on the number of topics.
    """

    def __init__(self, limits: QueueParams, pdu_size: int) -> None:
        self._limits = limits
        self._pdu_size = pdu_size
        self._lanes: dict[tuple[int, int, int, int], Lane] = {}
        # Non-empty levels in service order.
        self.levels: list[Level] = []
        self._level_by_key: dict[tuple[int, int], Level] = {}
        self._by_class: dict[Qos, OrderedDict[Outgoing, None]] = {q: OrderedDict() for q in Qos}
        self._class_bytes = dict.fromkeys(Qos, 0)
        self._by_topic: dict[int, QueuedOfTopic] = {}
        self.queued = 0
        self.queued_bytes = 0
        self._with_lifespan = 0
        self.relays = False
        """Whether the queue has ever held PDUs of other robots."""
        self.lives = Lives()

    def __bool__(self) -> bool:
        return bool(self.levels)

    def put(self, message: Outgoing, policy: TopicPolicy, bytes_per_s: float) -> str | None:
        """Queue `message`, dropping others to make room if necessary.

        Returns None, or the ledger's reason if `message` itself was dropped. Limits in seconds are
        converted with `bytes_per_s`, the present capacity of the channel.
        """
        limits, size = self._limits, len(message.payload)
        most = min(limits.max_bytes, limits.max_airtime_s * bytes_per_s)
        if not self._can_make_room(message, most):
            self.lives.drop(message, "tx_overflow_new")
            return "tx_overflow_new"
        topic, depth = self._by_topic.get(message.topic_id), policy.kept
        if topic is not None:
            while depth and len(like := topic.like(message)) >= depth:
                self.lives.drop(self._withdraw_waiting(next(iter(like))), "tx_superseded")
            of_topic = min(policy.queue_bytes or inf, (policy.queue_s or inf) * bytes_per_s)
            while topic.messages and topic.n_bytes + size > of_topic:
                self.lives.drop(self._withdraw_waiting(topic.oldest), "tx_topic_full")
        while self.queued >= limits.max_messages or self.queued_bytes + size > most:
            self.lives.drop(self._withdraw_waiting(self._victim()), "tx_overflow_old")
        self._enqueue(message, policy.weight)
        return None

    def begin(self, lane: Lane, entry_id: int, k: int, total: int, start: float) -> None:
        """Begin the lane's first waiting message: cut it, under `entry_id`, into `total` fragments
        of `k` bytes, sent from `start` on.
        """
        message = lane.waiting.popleft()
        self._forget_queued(message)
        lane.current = message
        message.cut(entry_id, k, total, start)
        self.lives.begin(message)

    def end(self, lane: Lane) -> None:
        """End the lane's current message, all of which is in PDUs."""
        lane.current = None

    def drop_all(self, reason: str) -> None:
        """Drop all waiting messages, in service order, and all messages in flight."""
        while self.levels:
            self.lives.drop(self.withdraw_head(self.levels[0].lanes[0]), reason)
        self.lives.drop_in_flight(reason)

    def next_relayed(self, first: Qos | None = None) -> int | None:
        """Probable source of the next PDU, or of the next one of class `first`; None: our own."""
        if not self.relays:
            return None
        levels = (each for each in self.levels if first is None or each.qos is first)
        level = next(levels, None)
        head = None if level is None else level.lanes[0].head
        return head.src if head is not None and head.is_whole else None

    def served(self, lane: Lane, octets: int, *, fills: bool = False) -> None:
        """Charge a lane's topic for an entry that it gave, and remove the lane if it is empty.

        `fills`: it was not its turn, but the entry filled a PDU behind one of its level.
        """
        level = self._level_by_key[lane.level_key]
        if lane.head is None:
            self._follow_up(lane, level)
        level.charge(lane.account, octets, fills=fills)

    def withdraw_head(self, lane: Lane) -> Outgoing:
        """Remove the lane's head, with all its fragments, and return it."""
        if lane.current is not None:
            message, lane.current = lane.current, None
        else:
            message = lane.waiting.popleft()
            self._forget_queued(message)
        self._follow_up(lane, self._level_by_key[lane.level_key])
        return message

    def next_class(self) -> Qos | None:
        """The class of the next message; None if the queue is empty."""
        return self.levels[0].qos if self.levels else None

    @property
    def next_message(self) -> Outgoing | None:
        """The next message; None if the queue is empty."""
        return self.levels[0].lanes[0].head if self.levels else None

    def waiting_bytes(self) -> dict[Qos, int]:
        """Bytes of each class that wait, in all messages and what is left of those begun, with what
        an entry and its age take.
        """
        waiting = {
            qos: self._class_bytes[qos] + MESSAGE_OVERHEAD * len(queue)
            for qos, queue in self._by_class.items()
        }
        for message in self._begun():
            left = max(0, len(message.body) - message.next_index * message.k)
            waiting[message.qos] += left + MESSAGE_OVERHEAD
        return waiting

    def destinations(self) -> set[int]:
        """Destinations of all messages in the queue, which may include BROADCAST."""
        return {dst for level in self.levels for dst in level.per_dst}

    def waiting_classes(self) -> set[Qos]:
        """Classes of all messages in the queue."""
        return {level.qos for level in self.levels}

    def oldest_arrival(self) -> float:
        """Earliest arrival time of all lanes' heads; infinity if the queue is empty."""
        return min(
            (
                lane.head.arrived_at
                for level in self.levels
                for lane in level.lanes
                if lane.head is not None
            ),
            default=float("inf"),
        )

    def first_begun(self) -> float:
        """Earliest time at which an unfinished message was last served; infinity: none is begun."""
        return min((each.last_at for each in self._begun()), default=inf)

    def has_lifespans(self) -> bool:
        """Whether any message in the queue, or begun, has a lifespan."""
        return self._with_lifespan > 0 or any(each.expires_at < inf for each in self._begun())

    def pending_bytes(self, enough: int) -> int:
        """Bytes that wait, including entry headers; counting stops at `enough`."""
        total = -ENTRY_HEADER_SIZE
        for level in self.levels:
            for lane in level.lanes:
                if lane.current is not None:
                    message = lane.current
                    total += message.next_size
                    total += ENTRY_HEADER_SIZE
                for message in lane.waiting:
                    total += len(message.payload) + ENTRY_HEADER_SIZE
                    if total >= enough:
                        return total
        return total

    @property
    def in_flight(self) -> int:
        """Number of messages begun, and neither sent nor dropped yet."""
        return len(self.lives.in_flight)

    def queued_by_class(self) -> dict[Qos, int]:
        """Number of messages of each class of which no part has been sent yet."""
        return {qos: len(queue) for qos, queue in self._by_class.items()}

    def queued_of_topic(self, topic_id: int) -> int:
        """Number of messages of one topic of which no part has been sent yet."""
        topic = self._by_topic.get(topic_id)
        return len(topic.messages) if topic is not None else 0

    def _begun(self) -> Iterator[Outgoing]:
        """Messages that are partly sent."""
        for level in self.levels:
            for lane in level.lanes:
                if lane.current is not None:
                    yield lane.current

    def _enqueue(self, message: Outgoing, weight: float) -> None:
        key = (message.qos, -message.priority, message.topic_id, message.dst)
        lane, level = self._lanes.get(key), self._level(key[:2])
        is_new = lane is None
        if lane is None:
            lane = self._lanes[key] = level.lane(message.topic_id, message.dst)
        lane.account.weight = weight
        lane.waiting.append(message)
        if is_new:
            level.add(lane, message)
        message.enter(lane)
        self.relays = self.relays or message.is_whole
        self._by_class[message.qos][message] = None
        topic = self._by_topic.get(message.topic_id)
        if topic is None:
            topic = self._by_topic[message.topic_id] = QueuedOfTopic()
        topic.add(message)
        self.queued += 1
        self._with_lifespan += message.expires_at < inf
        self.queued_bytes += len(message.payload)
        self._class_bytes[message.qos] += len(message.payload)

    def _level(self, key: tuple[int, int]) -> Level:
        level = self._level_by_key.get(key)
        if level is None:
            level = self._level_by_key[key] = Level(key, self._pdu_size)
            insort(self.levels, level, key=lambda each: each.key)
        return level

    def _follow_up(self, lane: Lane, level: Level) -> None:
        """Put a lane in the place of its next message, or remove it if there is none."""
        if lane.head is not None:
            level.move(lane)
            return
        level.remove(lane)
        del self._lanes[*lane.level_key, lane.topic_id, lane.dst]
        if not level.lanes:
            del self._level_by_key[level.key]
            del self.levels[bisect_left(self.levels, level.key, key=lambda each: each.key)]

    def _can_make_room(self, message: Outgoing, most_bytes: float) -> bool:
        """Whether `message` would fit if all messages of its class and below were dropped."""
        limits, size = self._limits, len(message.payload)
        if self.queued < limits.max_messages and self.queued_bytes + size <= most_bytes:
            return True
        higher = [qos for qos in Qos if qos < message.qos]
        return (
            sum(len(self._by_class[qos]) for qos in higher) < limits.max_messages
            and sum(self._class_bytes[qos] for qos in higher) + size <= most_bytes
        )

    def _victim(self) -> Outgoing:
        """The oldest message of the topic that fills the queue, in the lowest class.

        That is the one with the most octets that wait, or messages if there are too many of these,
        for its weight. So a topic that floods the queue loses messages, and no other does.
        """
        lowest = max(qos for qos, queue in self._by_class.items() if queue)
        is_by_number = self.queued >= self._limits.max_messages

        def fills(lane: Lane) -> tuple[float, float]:
            topic = self._by_topic[lane.topic_id]
            n = len(topic.messages) if is_by_number else topic.n_bytes
            return n / lane.account.weight, -lane.waiting[0].arrived_at

        levels = (level for level in self.levels if level.qos is lowest)
        return max(
            (lane for level in levels for lane in level.lanes if lane.waiting), key=fills
        ).waiting[0]

    def _withdraw_waiting(self, message: Outgoing) -> Outgoing:
        """Remove `message`; the oldest of its class or topic is the first of its lane."""
        lane = message.lane
        if lane.waiting[0] is not message:
            # It is the oldest of its producer key, and other keys of the topic are ahead of it.
            lane.waiting.remove(message)
            self._forget_queued(message)
            return message
        lane.waiting.popleft()
        self._forget_queued(message)
        if lane.current is None:
            self._follow_up(lane, self._level_by_key[lane.level_key])
        return message

    def _forget_queued(self, message: Outgoing) -> None:
        del self._by_class[message.qos][message]
        self._by_topic[message.topic_id].remove(message)
        self.queued -= 1
        self._with_lifespan -= message.expires_at < inf
        self.queued_bytes -= len(message.payload)
        self._class_bytes[message.qos] -= len(message.payload)
