"""Decodes and checks messages from producers; passes them on, or refuses them with a reason."""

from collections.abc import Callable
from functools import partial
from typing import Protocol

from sdrlinkd.bus import envelope
from sdrlinkd.client import (
    MessageRefusedError,
    check_wishes,
    too_large,
    too_short,
    unknown_topic,
    wrong_type,
)
from sdrlinkd.config import Setup
from sdrlinkd.errors import EnvelopeError
from sdrlinkd.link import AS_CONFIGURED, CDR_HEADER_SIZE, QOS_BY_LABEL, Overrides
from sdrlinkd.wire import BROADCAST, Topic


class Ingress(Protocol):
    """The receiver of messages from the bus."""

    def submit(
        self,
        topic_id: int,
        payload: bytes,
        overrides: Overrides = AS_CONFIGURED,
        published_ns: int | None = None,
    ) -> None:
        """Take a valid message; `published_ns` is in ns since 1970, None if not given."""

    def refuse(
        self,
        reason: str,
        topic_id: int | None = None,
        receipt: str = "",
        dst: int | None = None,
    ) -> None:
        """Count a refused message under the ledger's `reason`.

        `receipt` is its receipt id and `dst` its destination, as in Overrides.
        """


TellRefused = Callable[[envelope.Receipt], None]
LONGEST_NAME = 256


class Intake:
    """Checks messages from producers.

    `tell` sends receipts for messages of unknown topics, which the link never sees.
    """

    def __init__(self, setup: Setup, ingress: Ingress, tell: TellRefused) -> None:
        self._topic_ids: dict[bytes, int] = {}
        self.topics: dict[str, Topic] = {}
        """The topics that are accepted, by their names on the bus."""
        self.names: dict[int, str] = {}
        """Their names on the bus, by topic id."""
        for name, topic_id in setup.topics_in.items():
            self.accept(name, setup.registry.topics[topic_id])
        self._most = setup.config.bus.max_message_bytes
        self._ingress = ingress
        self._tell = tell
        self._last_bad: Callable[[], str] = str

    def accept(self, name: str, topic: Topic) -> bool:
        """Accept messages under bus topic `name`; False if they were accepted before as these."""
        is_new = self.topics.get(name) != topic
        self.topics[name] = topic
        self._topic_ids[name.encode() + b"\0"] = topic.id
        self.names[topic.id] = name
        return is_new

    @property
    def last_bad(self) -> str:
        """What was wrong with the last refused message."""
        return envelope.shown(self._last_bad())

    def take(self, frames: list[bytes]) -> None:
        """Decode and check a message, then pass it on or refuse it."""
        try:
            topic, header, payload = envelope.decode(frames)
        except EnvelopeError as error:
            self._refuse_envelope(frames, str(error))
            return
        receipt, dst = ("", None) if header is None else (header.id or "", header.d)
        topic_id = self._topic_ids.get(topic)
        if topic_id is None:
            # Search for the intended name only when the text is read: a flood leaves no time.
            words = partial(unknown_topic, name := _name(topic), self.topics)
            self._refuse_unowned("tx_unknown_topic", words, name, receipt, dst)
            return
        size = len(payload)
        if size < CDR_HEADER_SIZE:
            words = partial(too_short, _name(topic), size)
            self._refuse("tx_bad_envelope", words, topic_id, receipt, dst)
        elif size > self._most:
            key = f"bus.max_message_bytes = {self._most}"
            words = partial(too_large, _name(topic), size, self._most, key)
            self._refuse("tx_too_big", words, topic_id, receipt, dst)
        elif header is None:
            self._ingress.submit(topic_id, payload)
        elif header.ty is not None and header.ty != (type_ := self._type(topic_id)):
            words = partial(wrong_type, _name(topic), header.ty, type_)
            self._refuse("tx_bad_envelope", words, topic_id, receipt, dst)
        else:
            overrides = Overrides(
                None if header.q is None else QOS_BY_LABEL[header.q],
                header.p,
                header.d,
                None if header.ls is None else header.ls * 1e-3,
                receipt=receipt,
                key=header.k or "",
            )
            self._ingress.submit(topic_id, payload, overrides, header.t)

    def _type(self, topic_id: int) -> str:
        return self.topics[self.names[topic_id]].type

    def _refuse(
        self, reason: str, words: Callable[[], str], topic_id: int, receipt: str, dst: int | None
    ) -> None:
        self._last_bad = words
        self._ingress.refuse(reason, topic_id, receipt, dst)

    def _refuse_envelope(self, frames: list[bytes], words: str) -> None:
        receipt, dst, fields = envelope.wanted_of(frames)
        try:
            check_wishes(*(fields.get(name) for name in ("q", "p", "d", "ls", "t", "k")))
        except MessageRefusedError as error:
            words = str(error)
        self._refuse_unowned("tx_bad_envelope", partial(str, words), _name(frames[0]), receipt, dst)

    def _refuse_unowned(
        self, reason: str, words: Callable[[], str], name: str, receipt: str, dst: int | None
    ) -> None:
        self._last_bad = words
        self._ingress.refuse(reason)
        if receipt:
            at = BROADCAST if dst is None else dst
            self._tell(envelope.Receipt(receipt, name, at, "dropped", reason))


def _name(topic: bytes) -> str:
    return topic[:LONGEST_NAME].removesuffix(b"\0").decode(errors="replace")
