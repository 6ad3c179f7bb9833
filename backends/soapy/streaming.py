"""In the radio process: which thread does what, until the daemon is gone."""

import threading
import time

from backends.soapy.counted import CountedSender
from backends.soapy.half_duplex import HalfDuplex
from backends.soapy.orders import Orders, Tally
from backends.soapy.receiving import Receiving
from backends.soapy.surface import DriverError
from backends.soapy.timed import TimedSender

TELL_S = 0.1
Sender = TimedSender | CountedSender


def stream(
    receiving: Receiving, sender: Sender | None, orders: Orders, full_duplex: bool, listen_s: float
) -> None:
    """Move samples. Raises DriverError when the device fails."""
    tally = Tally(receiving, sender)
    if isinstance(sender, CountedSender) and not full_duplex:
        _in_turns(HalfDuplex(receiving, sender, orders, listen_s), orders, tally)
    else:
        _at_once(receiving, sender, orders, tally)


def _in_turns(both: HalfDuplex, orders: Orders, tally: Tally) -> None:
    due = time.monotonic()
    while not orders.is_over:
        both.step()
        if time.monotonic() >= due:
            due = time.monotonic() + TELL_S
            tally.tell(orders)


def _at_once(receiving: Receiving, sender: Sender | None, orders: Orders, tally: Tally) -> None:
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
