"""Recordings in the clear: a PDU with commands that comes again, and our own id from others."""

import hashlib
from collections import deque

from sdrlinkd.link.receive.acceptance import Acceptance
from sdrlinkd.link.topics import HeardTopics
from sdrlinkd.wire import BROADCAST, Pdu

COMMANDS_S = 10.0
"""Time in s for which a PDU with commands is known again."""
MOST_KEPT = 4096
MOST_OWN = 4096
"""How many of our PDUs are known again."""
HEAD, TAIL = slice(4), slice(5, 10)
"""The first octets of a PDU, without the one that a relay changes."""
FOREIGN, FOREIGN_S = 3, 10.0
"""How many PDUs with our id within how many s show that another robot has it."""


class RecentCommands:
    """Knows the PDUs with commands of the last 10 s again, octet by octet.

    The duplicate filter knows fewer PDUs, and forgets them when their source restarts. New commands
    differ: in their age, or in the numbers of PDU and entry.
    """

    def __init__(self, acceptance: Acceptance, topics: HeardTopics) -> None:
        self._acceptance = acceptance
        self._topics = topics
        self._seen: set[bytes] = set()
        self._order: deque[tuple[float, bytes]] = deque()

    def has_heard(self, pdu: Pdu, octets: bytes, at: float) -> bool:
        """Whether a PDU that came at `at` holds commands and came before; if not, it is noted."""
        commands, topic = self._acceptance.commands, self._topics.topic
        to_one = pdu.dst != BROADCAST
        heard = (topic(pdu.src, entry.topic_id) for entry in pdu.entries)
        if not any(commands(each, to_one=to_one) for each in heard):
            return False
        order = self._order
        while order and (order[0][0] < at - COMMANDS_S or len(order) > MOST_KEPT):
            self._seen.discard(order.popleft()[1])
        digest = hashlib.blake2b(octets, digest_size=8).digest()
        if digest in self._seen:
            return True
        self._seen.add(digest)
        order.append((at, digest))
        return False

    def begin_anew(self) -> None:
        """Go on with another clock; what was heard lately is not known again."""
        self._seen.clear()
        self._order.clear()


class OwnPdus:
    """What we sent lately, to tell echoes and relayed copies of it from another robot's PDUs."""

    def __init__(self) -> None:
        self.begins: deque[bytes] = deque(maxlen=MOST_OWN)
        """The octets HEAD and TAIL of our last PDUs."""
        self._foreign: deque[float] = deque(maxlen=FOREIGN)

    def heard(self, octets: bytes, at: float) -> None:
        """Take an intact PDU with our id that came at `at`."""
        if octets[HEAD] + octets[TAIL] not in self.begins:
            self._foreign.append(at)

    def begin_anew(self) -> None:
        """Go on with another clock; what was heard lately is forgotten."""
        self._foreign.clear()

    def has_double(self, now: float) -> bool:
        """Whether another robot was heard lately that has our id."""
        return len(self._foreign) == FOREIGN and now - self._foreign[0] < FOREIGN_S
