"""A program that echoes samples, like GNU Radio or srsRAN."""

import contextlib
import struct
import threading

import zmq

from backends import ZmqParams, ZmqRadio
from tests.backends.radios import BLOCK_S

ITEM = 8
LOOK_MS = 20
ASKS_700 = struct.pack("<I", 700)


class Echo:
    """Echoes samples on a thread, with the patterns of gr-zeromq; `word` is its request."""

    def __init__(self, folder, pattern, word=ASKS_700):
        self._context = zmq.Context()
        kinds = {"push": (zmq.PULL, zmq.PUSH), "pub": (zmq.SUB, zmq.PUB), "req": (zmq.REQ, zmq.REP)}
        self._in, self._out = (self._context.socket(kind) for kind in kinds[pattern])
        for each in (self._in, self._out):
            each.setsockopt(zmq.RCVTIMEO, LOOK_MS)
            each.setsockopt(zmq.SNDTIMEO, LOOK_MS)
            each.setsockopt(zmq.LINGER, 0)
            each.setsockopt(zmq.RECONNECT_IVL, 5)
        if pattern == "pub":
            self._in.setsockopt(zmq.SUBSCRIBE, b"")
        self.send, self.receive = f"ipc://{folder}/to-peer", f"ipc://{folder}/from-peer"
        self._out.bind(self.receive)
        self._in.connect(self.send)
        self._word = word
        self._ended = threading.Event()
        work = self._answer if pattern == "req" else self._pass
        self._thread = threading.Thread(target=self._work, args=(work,), daemon=True)
        self._thread.start()

    def end(self):
        """End the echo; ending twice is fine."""
        self._ended.set()
        self._thread.join()
        self._context.term()

    def _work(self, work):
        with contextlib.suppress(EOFError):
            work()
        self._in.close()
        self._out.close()

    def _try(self, call, *arguments):
        while not self._ended.is_set():
            with contextlib.suppress(zmq.Again):
                return call(*arguments)
        raise EOFError

    def _pass(self):
        while True:
            self._try(self._out.send, self._try(self._in.recv))

    def _answer(self):
        have = b""
        while True:
            n = ITEM * struct.unpack("<I", self._try(self._out.recv))[0]
            while not have:
                self._try(self._in.send, self._word)
                have = self._try(self._in.recv)
            self._try(self._out.send, have[:n])
            have = have[n:]


class ZmqEcho(ZmqRadio):
    """A radio with an echo as its peer."""

    def __init__(self, folder, pattern):
        self._echo = Echo(folder, pattern)
        echo = self._echo
        params = ZmqParams(send=echo.send, receive=echo.receive, pattern=pattern)
        super().__init__(params, BLOCK_S)

    async def close(self):
        """Close the radio and end the echo."""
        await super().close()
        self._echo.end()
