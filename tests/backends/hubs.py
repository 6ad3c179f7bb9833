"""Hubs in threads of this process, and robots that listen on their air."""

import asyncio
import contextlib
import socket
import threading

import msgspec
import numpy as np
import zmq

from backends import (
    AirParams,
    EtherHub,
    EtherRadio,
    HubWatch,
    RadioParams,
    Tuning,
    World,
    hub_at,
    hub_in,
)
from backends.testing import AIR, SKY, protocol
from tests.backends.radios import BLOCK_S, RATE, TUNING, opened, record
from tests.waiting import wait_for

SNR_DB = 60.0
NODE, LISTENER = 1, 2
TIMEOUT_S = 20


def hub_air(**params):
    """An air for the radios of these tests."""
    given = {"rate_hz": RATE, "frequency_hz": TUNING.frequency_hz, "block_s": BLOCK_S}
    return AirParams(**{"snr_db": SNR_DB, **given, **params})


@contextlib.contextmanager
def serving(folder, radios=(), paced=True, seed=0, until_s=np.inf, listen=None, world=World, **air):
    """Run a hub on the folder, and stop it at the end. `world` makes the world of its air."""
    shared = hub_air(**air)
    hub = EtherHub(
        folder, shared, world(shared, {}), dict(radios), paced=paced, seed=seed, until_s=until_s,
        listen=listen,
    )  # fmt: skip
    ready = threading.Event()
    thread = threading.Thread(target=hub.run, args=(ready.set,), name="hub", daemon=True)
    thread.start()
    assert ready.wait(TIMEOUT_S)
    try:
        yield hub
    finally:
        hub.stop()
        with RawRadio(folder) as raw:
            # In lock-step the hub may be waiting for a message.
            raw.ask(protocol.Question())
            thread.join(TIMEOUT_S)
        assert not thread.is_alive()


def ask(folder):
    """The state of the hub."""
    with HubWatch(folder) as watch:
        return watch.ask()


async def until(condition):
    """Wait for something that another thread does."""
    await asyncio.to_thread(wait_for, condition)


class RawRadio:
    """Speaks the protocol by hand: everything that a radio could send, and more."""

    def __init__(self, folder):
        self._context = zmq.Context()
        self._down = self._connected(zmq.DEALER, folder / AIR)
        self._up = self._connected(zmq.PUSH, folder / SKY)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.vanish()

    def ask(self, *frames):
        """Send to the hub's `air`; messages are encoded."""
        self._down.send_multipart(_encoded(frames))

    def push(self, *frames):
        """Send to the hub's `sky`."""
        self._up.send_multipart(_encoded(frames))

    def hear(self, kind=msgspec.Struct):
        """Receive the next message of that kind."""
        while self._down.poll(1000 * TIMEOUT_S):
            message = protocol.from_hub(self._down.recv_multipart()[0])
            if isinstance(message, kind):
                return message
        raise AssertionError("the hub says nothing")

    def greet(self, node, who="made by hand"):
        """Ask to join as a radio would."""
        hello = protocol.Hello(
            version=protocol.VERSION,
            node=node,
            who=who,
            rate_hz=RATE,
            frequency_hz=TUNING.frequency_hz,
        )
        self.ask(hello)

    def join(self, node, who="made by hand"):
        """Join as a radio would; returns the token."""
        self.greet(node, who)
        return self.hear(protocol.Welcome).token

    def vanish(self):
        """Disappear without Bye, like a killed process."""
        self._context.destroy(linger=0)

    def _connected(self, kind, path):
        socket = self._context.socket(kind)
        socket.connect(f"ipc://{path}")
        return socket


def _encoded(frames):
    return [protocol.encode(each) if isinstance(each, msgspec.Struct) else each for each in frames]


class Listener:
    """Another robot on the same air, which records everything from its index 0 on, on a thread."""

    def __init__(self, folder, rate_hz=RATE):
        self._folder = folder
        self._tuning = Tuning(rate_hz, TUNING.frequency_hz)
        self._moved = threading.Condition()
        self._joined = threading.Event()
        self._parts = []
        self._end = 0
        self.is_slow = False
        """Whether it has heard bursts later than they were sent, as this machine was busy."""
        self._is_over = False
        self._thread = threading.Thread(target=lambda: asyncio.run(self._listen()), daemon=True)
        self._thread.start()
        assert self._joined.wait(TIMEOUT_S)

    def wait_until(self, end):
        """Wait until all samples before `end` have been heard."""
        with self._moved:
            assert self._moved.wait_for(lambda: self._end >= end, TIMEOUT_S)

    def stop(self):
        """Stop with the next block; returns everything heard."""
        self._is_over = True
        self._thread.join(TIMEOUT_S)
        assert not self._thread.is_alive()
        return np.concatenate(self._parts)

    async def _listen(self):
        async with opened(
            EtherRadio(hub_in(self._folder), LISTENER, "the listener"), self._tuning
        ) as radio:
            self._joined.set()
            async for block in radio.blocks():
                with self._moved:
                    self._parts.append(
                        np.zeros(block.n) if block.samples is None else block.samples
                    )
                    self._end = block.index + block.n
                    self.is_slow = radio.counters["bursts_slow"] > 0
                    self._moved.notify_all()
                if self._is_over:
                    return


def free_hub_port():
    """An address on which nobody listens, nor on the port after it."""
    while True:
        with socket.socket() as one, socket.socket() as next_one:
            one.bind(("127.0.0.1", 0))
            port = one.getsockname()[1]
            with contextlib.suppress(OSError, OverflowError):
                next_one.bind(("127.0.0.1", port + 1))
                return hub_at(f"127.0.0.1:{port}", "test")


class RadioOnHub(EtherRadio):
    """A radio that starts its own hub when opened; what it sends is recorded in the file `sent`."""

    def __init__(self, folder, params, paced, hub=None):
        super().__init__(hub or hub_in(folder / "air"), NODE, "the radio under test")
        self._folder = folder / "air"
        self._sent = folder / "sent"
        self._stack = contextlib.ExitStack()
        self._listener = None
        self._first = 0
        self._params, self._paced = params, paced
        self.is_recorded_late = False

    async def open(self, tuning):
        """Start the hub and the listener, and open the radio."""
        radios = {NODE: self._params, LISTENER: RadioParams()}
        listen = self._hub if self._hub.is_remote else None
        served = serving(self._folder, radios, self._paced, listen=listen)
        hub = self._stack.enter_context(served)
        self._listener = Listener(self._folder)
        await super().open(tuning)
        began_s, listens_s = (hub.medium.time(node, 0) for node in (NODE, LISTENER))
        self._first = round((began_s - listens_s) * tuning.rate_hz)

    async def close(self):
        """Close everything; the recording is as long as what the radio has heard."""
        listener, self._listener = self._listener, None
        end = self._first + (0 if self._antenna is None else self._antenna.end)
        if listener is not None:
            listener.wait_until(end)
        await super().close()
        if listener is not None:
            record(self._sent, listener.stop()[self._first : end])
            self.is_recorded_late = listener.is_slow
        self._stack.close()
