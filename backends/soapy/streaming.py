"""In the radio process: which thread does what, until the daemon is gone."""

import threading
import time

from backends.soapy.counted import CountedSender
from backends.soapy.half_duplex import HalfDuplex
from backends.soapy.orders import Orders
from backends.soapy.protocol import Counted
from backends.soapy.receiving import Receiving
from backends.soapy.surface import DriverError
from backends.soapy.timed import TimedSender

TELL_S = 0.1
Sender = TimedSender | CountedSender


class _Tally:
    """What receiving and sending have counted, told when it has changed."""

    def __init__(self, receiving: Receiving, sender: Sender | None) -> None:
        self._receiving, self._sender = receiving, sender
        self._told: Counted | None = None

    def tell(self, orders: Orders) -> None:
        """The news, if there is any."""
        sent = self._sender.counters if isinstance(self._sender, CountedSender) else {}
        rate = self._receiving.rate
        counters = {**self._receiving.counters, "rate_faults": rate.faults, **sent}
        now = Counted(counters, rate.notice)
        if now != self._told:
            self._told = now
            orders.say(now)


def stream(
    receiving: Receiving, sender: Sender | None, orders: Orders, full_duplex: bool, listen_s: float
) -> None:
    """Move samples. Raises DriverError when the device fails."""
    tally = _Tally(receiving, sender)
    if isinstance(sender, CountedSender) and not full_duplex:
        _in_turns(HalfDuplex(receiving, sender, orders, listen_s), orders, tally)
    else:
        _at_once(receiving, sender, orders, tally)


def _in_turns(both: HalfDuplex, orders: Orders, tally: _Tally) -> None:
    due = time.monotonic()
    while not orders.is_over:
        both.step()
        if time.monotonic() >= due:
            due = time.monotonic() + TELL_S
            tally.tell(orders)


def _at_once(receiving: Receiving, sender: Sender | None, orders: Orders, tally: _Tally) -> None:
    """Receiving has a thread of its own."""
    failures: list[Exception] = []
    stopped = threading.Event()

    def receive() -> None:
        try:
            while not stopped.is_set():
                receiving.step()
        except (DriverError, OSError) as error:
            failures.append(error)

    thread = threading.Thread(target=receive)
    thread.start()
    try:
        while not failures and not orders.is_over:
            if sender is None:
                orders.wait(TELL_S)
            else:
                sender.step()
            tally.tell(orders)
        if sender is not None:
            sender.stop()
    finally:
        stopped.set()
        thread.join()
    for failure in failures:
        raise failure
