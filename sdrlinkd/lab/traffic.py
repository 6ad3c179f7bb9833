"""Producers and consumers of a run."""

import threading
import time
from collections import defaultdict
from pathlib import Path
from typing import Self

from sdrlinkd.adapters import due_messages, paced
from sdrlinkd.client import Message, NoDaemonError, Publisher
from sdrlinkd.demo import Hearing, Sample, Source, Trace

FOREVER = float("inf")


def plan(source: Source, duration_s: float) -> dict[str, list[Sample]]:
    """The messages that a robot sends in lock-step, by registry name, at times of the air."""
    prefix = f"/{source.namespace}/" if source.namespace else "/"
    names = [topic.name for topic in source.topics]
    ids = {name: i for i, name in enumerate(names)}
    sent: dict[str, list[Sample]] = defaultdict(list)
    for due in due_messages(source.recording, duration_s, 0.0, ids):
        sent[names[due.topic_id].removeprefix(prefix)].append(Sample(due.at, due.payload))
    return sent


class Player(threading.Thread):
    """Publishes a robot's messages on its daemon's bus in real time, on its own thread."""

    def __init__(self, source: Source, directory: Path) -> None:
        super().__init__(name="player", daemon=True)
        self._source = source
        self._directory = directory
        self._stopped = threading.Event()
        self.began_at = 0.0
        self.sent: dict[str, list[Sample]] = defaultdict(list)
        self.problem = ""

    def run(self) -> None:
        """Publish until all is sent or the thread is told to stop."""
        prefix = f"/{self._source.namespace}/" if self._source.namespace else "/"
        self.began_at = time.monotonic()
        try:
            with Publisher(self._directory, checked=False) as publisher:
                messages = paced(self._source.messages(), 1.0, sleep=self._wait)
                for message in messages:
                    if self._stopped.is_set():
                        return
                    name = message.topic.removeprefix(prefix)
                    self.sent[name].append(Sample(time.monotonic(), message.cdr))
                    publisher.send(message.topic, message.cdr, type=message.type)
        except NoDaemonError as error:
            self.problem = str(error)

    def _wait(self, seconds: float) -> None:
        self._stopped.wait(seconds)

    def __enter__(self) -> Self:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stopped.set()
        self.join()


class Listener(Hearing):
    """Records everything that a daemon republishes.

    `by_age`: take the latency from the message's age, as the air does not run in real time.
    """

    def __init__(self, directory: Path, by_age: bool) -> None:
        super().__init__(directory, self._note)
        self._by_age = by_age
        self.received: dict[int, dict[str, list[Sample]]] = defaultdict(lambda: defaultdict(list))
        """Received messages by source and registry name."""

    def _note(self, message: Message, at: float) -> None:
        age_s = None
        if self._by_age:
            at = FOREVER
            age_s = FOREVER if message.age_us is None else message.age_us * 1e-6
        name = message.topic.removeprefix(f"/rx_robot_{message.source}/")
        self.received[message.source][name].append(
            Sample(at, message.payload, age_s, message.hops_left)
        )


def trace_of(source: Source, sent: dict[str, list[Sample]], got: dict[str, list[Sample]]) -> Trace:
    """The trace of one robot's messages at another robot."""
    types = {topic.name: topic.type for topic in source.registry.topics}
    return Trace(types, sent, got)
