"""Producers, consumers, and what is measured of a daemon."""

import os
import resource
import sys
import textwrap
import threading
from pathlib import Path

from sdrlinkd.client import Subscriber
from sdrlinkd.process import Process

CDR = b"\0\1\0\0"
PAGE = os.sysconf("SC_PAGE_SIZE")


def spawn(code, directory):
    """Run a Python program for the daemon in `directory`."""
    environment = {**os.environ, "SDRLINKD_RUNTIME_DIR": str(directory)}
    return Process([sys.executable, "-c", textwrap.dedent(code)], environment=environment)


class Counting(threading.Thread):
    """A consumer that counts messages by topic, and the damaged ones."""

    def __init__(self, directory, topic="/*", is_whole=lambda _: True):
        super().__init__(daemon=True)
        self.subscriber = Subscriber(topic, runtime_dir=directory, depth=0)
        self.count, self.damaged, self.by_topic = 0, 0, {}
        self._is_whole, self._done = is_whole, threading.Event()

    def run(self):
        while not self._done.is_set():
            message = self.subscriber.receive(timeout_s=0.1)
            if message is not None:
                self.count += 1
                self.by_topic[message.topic] = self.by_topic.get(message.topic, 0) + 1
                self.damaged += not self._is_whole(message.payload)

    def __enter__(self):
        self.start()
        return self

    def __exit__(self, *_):
        self._done.set()
        self.join()
        self.subscriber.close()


def rss_mib(daemon):
    """Memory of a daemon in MiB."""
    return int(Path(f"/proc/{daemon.pid}/statm").read_text().split()[1]) * PAGE / 2**20


def descriptors(daemon):
    """How many descriptors a daemon has."""
    return sum(1 for _ in Path(f"/proc/{daemon.pid}/fd").iterdir())


def cpu_s(daemon):
    """CPU time of a daemon in s."""
    fields = Path(f"/proc/{daemon.pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def problems(daemon):
    """What does not add up in a daemon's ledger."""
    with daemon.control() as control:
        return control.ask("check")["problems"]


def own_rss_mib():
    """Largest memory of this process so far, in MiB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
