"""Assigns the work to threads, until the daemon is gone."""

import threading
import time

from backends.soapy.binding import DriverError
from backends.soapy.protocol import CountersReport
from backends.soapy.radio_process.half_duplex import HalfDuplex
from backends.soapy.radio_process.rx_stream import RxStream
from backends.soapy.radio_process.sample_counted_tx import SampleCountedTransmitter
from backends.soapy.radio_process.timestamped_tx import TimestampedTransmitter
from backends.soapy.radio_process.tx_commands import TxCommands

TELL_S = 0.1
Transmitter = TimestampedTransmitter | SampleCountedTransmitter


class _CounterReports:
    """Counters of receiving and sending, reported when they have changed."""

    def __init__(self, rx_stream: RxStream, transmitter: Transmitter | None) -> None:
        self._rx_stream, self._transmitter = rx_stream, transmitter
        self._told: CountersReport | None = None

    def tell(self, commands: TxCommands) -> None:
        """Report the counters if they have changed since the last report."""
        sent = (
            self._transmitter.counters
            if isinstance(self._transmitter, SampleCountedTransmitter)
            else {}
        )
        rate = self._rx_stream.rate
        counters = {**self._rx_stream.counters, "rate_faults": rate.faults, **sent}
        now = CountersReport(counters, rate.notice)
        if now != self._told:
            self._told = now
            commands.say(now)


def stream(
    rx_stream: RxStream,
    transmitter: Transmitter | None,
    commands: TxCommands,
    full_duplex: bool,
    listen_s: float,
) -> None:
    """Move samples until the daemon is gone. Raises DriverError when the device fails."""
    reports = _CounterReports(rx_stream, transmitter)
    if isinstance(transmitter, SampleCountedTransmitter) and not full_duplex:
        _in_turns(HalfDuplex(rx_stream, transmitter, commands, listen_s), commands, reports)
    else:
        _at_once(rx_stream, transmitter, commands, reports)


def _in_turns(both: HalfDuplex, commands: TxCommands, reports: _CounterReports) -> None:
    due = time.monotonic()
    while not commands.is_over:
        both.step()
        if time.monotonic() >= due:
            due = time.monotonic() + TELL_S
            reports.tell(commands)


def _at_once(
    rx_stream: RxStream,
    transmitter: Transmitter | None,
    commands: TxCommands,
    reports: _CounterReports,
) -> None:
    """Receive on another thread, and send on this one."""
    failures: list[Exception] = []
    stopped = threading.Event()

    def receive() -> None:
        try:
            while not stopped.is_set():
                rx_stream.step()
        except (DriverError, OSError) as error:
            failures.append(error)

    thread = threading.Thread(target=receive)
    thread.start()
    try:
        while not failures and not commands.is_over:
            if transmitter is None:
                commands.wait(TELL_S)
            else:
                transmitter.step()
            reports.tell(commands)
        if transmitter is not None:
            transmitter.stop()
    finally:
        stopped.set()
        thread.join()
    for failure in failures:
        raise failure
