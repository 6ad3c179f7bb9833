"""One 724 B message from link to link, as calls and files."""

import sys
from collections.abc import Callable
from pathlib import Path
from random import Random
from types import FrameType
from typing import NamedTuple, ParamSpec, TypeVar

from sdrlinkd.link import (
    AccessParams,
    Link,
    LinkParams,
    Opportunity,
    Outcome,
    PduLinkTraits,
    QueueParams,
    RateParams,
    ReassemblyParams,
)
from sdrlinkd.wire import CONTROL_TOPIC_ID, Beacon, make_registry, parse, parse_records

P = ParamSpec("P")
T = TypeVar("T")
ROOT = Path(__file__).parents[2]
ROOMS = tuple(str(ROOT / "sdrlinkd" / room) for room in ("link", "wire"))
MESSAGE = bytes(724)
PDU_SIZE = 1024
PERIOD_S = 0.1
PDU_S = 1.4e-3
OVERHEAD_S = 1e-4
MOST_PDUS = 64
MESSAGES = 40
"""Number of messages; the first ones warm up forecasts and caches."""


class Step(NamedTuple):
    """One call from outside, and its calls in `link` and `wire`."""

    name: str
    files: tuple[str, ...]
    """The file of each call, in order."""

    @property
    def changes(self) -> int:
        """Number of calls into another file than the call before."""
        return sum(a != b for a, b in zip(self.files, self.files[1:], strict=False))


class _Recorder:
    def __init__(self) -> None:
        self.steps: list[Step] = []

    def __call__(self, name: str, function: Callable[P, T], *given: P.args, **more: P.kwargs) -> T:
        """Result of `function`; its Python calls are recorded."""
        files: list[str] = []

        def note(frame: FrameType, event: str, _: object) -> None:
            path = frame.f_code.co_filename
            if event == "call" and path.startswith(ROOMS) and frame.f_code.co_name[0] != "<":
                files.append(str(Path(path).relative_to(ROOT)))

        sys.setprofile(note)
        try:
            result = function(*given, **more)
        finally:
            sys.setprofile(None)
        self.steps.append(Step(name, tuple(files)))
        return result


def _link(own_id: int) -> Link:
    link = Link(
        LinkParams(pdu_size=PDU_SIZE),
        QueueParams(),
        ReassemblyParams(),
        make_registry([("odom", "nav_msgs/msg/Odometry")]),
        own_id,
        Random(own_id),
    )
    link.attach(PduLinkTraits(), AccessParams(), RateParams())
    return link


def _opportunity(now: float) -> Opportunity:
    return Opportunity(now, _airtime_s, _most_pdus)


def _airtime_s(_: int, n_pdus: int) -> float:
    return OVERHEAD_S + n_pdus * PDU_S


def _most_pdus(_: int, airtime_s: float) -> int:
    return int(min(MOST_PDUS, max(0.0, (airtime_s - OVERHEAD_S) / PDU_S)))


def trace(with_beacon: bool) -> list[Step]:
    """The steps of one message after others like it, with or without a beacon in the same PDU."""
    sender, receiver = _link(1), _link(2)
    record, found = _Recorder(), list[Step]()
    for number in range(MESSAGES):
        record.steps = []
        now = 0.05 + number * PERIOD_S
        sender.handle_timers(now)
        receiver.handle_timers(now)
        record("submit", sender.submit, 0, MESSAGE, now)
        burst = record("next_burst", sender.next_burst, _opportunity(now))
        if burst is None:
            raise RuntimeError("nothing was sent")
        record("confirm", sender.confirm, burst, Outcome.SENT, now + PDU_S)
        heard = [
            message
            for pdu in burst.pdus
            for message in record("hear", receiver.hear, pdu, now + PDU_S)
        ]
        for message in heard:
            record("delivered", receiver.delivered, message, now + 2 * PDU_S)
        if [message.payload for message in heard] != [MESSAGE]:
            raise RuntimeError("the message did not arrive intact")
        entries = [entry for pdu in burst.pdus for entry in parse(pdu, PDU_SIZE).entries]
        records = [
            each
            for entry in entries
            if entry.topic_id == CONTROL_TOPIC_ID
            for each in parse_records(entry.payload)
        ]
        if any(isinstance(each, Beacon) for each in records) == with_beacon:
            found = record.steps
    return found
