"""The radio process: owns the device and moves samples, nothing else.

Started by SoapyRadio, which hands it two sockets and two pieces of shared memory. A driver that
crashes or hangs takes only this process with it. It opens the device once, and ends when the device
fails or the daemon is gone.
"""

import contextlib
import os
import signal
import socket
import sys
import threading
import time
from collections.abc import Callable

from backends.soapy.clock import SampleTime
from backends.soapy.counted import CountedSender
from backends.soapy.device import Device
from backends.soapy.half_duplex import HalfDuplex
from backends.soapy.library import load_library, why_not
from backends.soapy.orders import Orders, Tally
from backends.soapy.outgoing import Outgoing
from backends.soapy.protocol import MOST_BYTES, Failed, Open, Opened, to_open
from backends.soapy.receiving import Receiving
from backends.soapy.ring import SampleRing
from backends.soapy.setting_up import choose_format, set_up
from backends.soapy.settings import Found, SettingError, SoapySettings, in_flight
from backends.soapy.surface import RX, TX, DriverError, Library, Stream
from backends.soapy.timed import TimedSender

RETRY_S = 0.25, 1.0
"""A device that went away is looked for again after so long; more each time."""
TALLY_S = 0.1
PRIORITY = -10
"""Where it may: samples do not wait."""
SWITCH_INTERVAL_S = 5e-4
"""Two threads that mostly wait in the driver should not wait for each other."""


def main() -> None:
    """`process.py CONTROL AIR RX_MEMORY TX_MEMORY`, numbers of inherited descriptors."""
    # Whoever stops the daemon with Ctrl-C lets it end us.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    sys.setswitchinterval(SWITCH_INTERVAL_S)
    with contextlib.suppress(PermissionError):
        os.setpriority(os.PRIO_PROCESS, 0, PRIORITY)
    control, air, rx_memory, tx_memory = (int(each) for each in sys.argv[1:5])
    with socket.socket(fileno=control) as control_socket, socket.socket(fileno=air) as air_socket:
        air_socket.setblocking(False)
        asked = to_open(control_socket.recv(MOST_BYTES))
        orders = Orders(control_socket, SampleRing(tx_memory, asked.tx_samples))
        try:
            _Session(asked, orders, air_socket, SampleRing(rx_memory, asked.rx_samples)).run()
        except SettingError as refusal:
            orders.say(Failed(str(refusal), is_refusal=True))
        except DriverError as error:
            orders.say(Failed(str(error)))


class _Session:
    """One device, from open to the end."""

    def __init__(self, asked: Open, orders: Orders, air: socket.socket, ring: SampleRing) -> None:
        self._asked = asked
        self._orders = orders
        self._air = air
        self._ring = ring

    def run(self) -> None:
        """Stream until the daemon closes its end. Raises SettingError, DriverError."""
        settings = self._asked.settings
        library = load_library()
        device = self._made(library, settings.device)
        if device is None:
            return
        try:
            self._stream(library, device, settings)
        finally:
            device.close()

    def _made(self, library: Library, args: str) -> Device | None:
        wait_s, most_s = RETRY_S
        while not self._orders.is_over:
            try:
                return Device(library, args)
            except DriverError as error:
                if not self._asked.wait:
                    raise SettingError(why_not(library, args, error)) from None
            self._orders.wait(wait_s)
            wait_s = min(2 * wait_s, most_s)
        return None

    def _stream(self, library: Library, device: Device, settings: SoapySettings) -> None:
        gains = set_up(device, settings)
        has_time, channel = device.has_time(), settings.channel
        clock = SampleTime(settings.rate_hz, has_time)
        rx_form = choose_format(device, settings, RX)
        rx = device.open_stream(RX, channel, rx_form, settings.stream_args)
        streams = [rx]
        try:
            receiving = Receiving(
                rx, rx_form, self._ring, self._air, clock, piece_of(settings, rx), has_time
            )
            sender: TimedSender | CountedSender | None = None
            tx: Stream | None = None
            full_duplex = device.full_duplex(channel)
            if settings.tx_enabled:
                tx_form = choose_format(device, settings, TX)
                tx = device.open_stream(TX, channel, tx_form, settings.stream_args)
                streams.append(tx)
                outgoing = Outgoing(tx, tx_form)
                if has_time and full_duplex:
                    sender = TimedSender(self._orders, outgoing, clock)
                else:
                    sender = CountedSender(
                        self._orders, outgoing, clock, settings.leading_transfers,
                        settings.longest_tx_s, 0.0 if full_duplex else settings.turnaround_s,
                        in_flight(settings, device.driver),
                    )  # fmt: skip
            self._orders.say(
                Opened(
                    Found(
                        driver=device.driver,
                        hardware=device.hardware,
                        binding=library.detail,
                        rate_hz=settings.rate_hz,
                        frequency_hz=settings.frequency_hz,
                        full_duplex=full_duplex,
                        has_time=has_time,
                        receives_in_s=piece_of(settings, rx) / settings.rate_hz,
                        tx_transfer_s=tx.mtu / settings.rate_hz if tx is not None else 0.0,
                        in_flight=in_flight(settings, device.driver),
                        gains=_told(gains),
                    )
                )
            )
            while not self._orders.has_begun and not self._orders.is_over:
                self._orders.wait(TALLY_S)
            receiving.start()
            self._run(receiving, sender, full_duplex)
        finally:
            for stream in streams:
                stream.deactivate()
                stream.close()

    def _run(
        self, receiving: Receiving, sender: TimedSender | CountedSender | None, full_duplex: bool
    ) -> None:
        tally = Tally([receiving.counters, *([sender.counters] if sender else [])])
        if isinstance(sender, CountedSender) and not full_duplex:
            both = HalfDuplex(receiving, sender, self._orders, self._asked.settings.listen_s)
            self._repeat(both.step, tally)
            return
        failures: list[Exception] = []
        stopped = threading.Event()
        thread = threading.Thread(target=self._receive, args=(receiving, stopped, failures))
        thread.start()
        try:
            while not failures and not self._orders.is_over:
                if sender is not None:
                    sender.step()
                else:
                    self._orders.wait(TALLY_S)
                self._tell(tally)
            if sender is not None:
                sender.stop()
        finally:
            stopped.set()
            thread.join()
        for failure in failures:
            raise failure

    def _receive(
        self, receiving: Receiving, stopped: threading.Event, failures: list[Exception]
    ) -> None:
        try:
            while not stopped.is_set():
                receiving.step()
        except (DriverError, OSError) as error:
            failures.append(error)

    def _repeat(self, step: Callable[[], None], tally: Tally) -> None:
        due = time.monotonic()
        while not self._orders.is_over:
            step()
            if time.monotonic() >= due:
                due = time.monotonic() + TALLY_S
                self._tell(tally)

    def _tell(self, tally: Tally) -> None:
        news = tally.news()
        if news is not None:
            self._orders.say(news)


def piece_of(settings: SoapySettings, stream: Stream) -> int:
    """Samples handed over at once: so many as wished, or whole transfers where they are longer."""
    return max(1, round(settings.block_s * settings.rate_hz), stream.mtu)


def _told(gains: dict[int, dict[str, float]]) -> str:
    names = {RX: "rx", TX: "tx"}
    return ", ".join(
        f"{names[way]} {element + ' ' if element else ''}{gain_db:g} dB"
        for way, by_element in gains.items()
        for element, gain_db in by_element.items()
    )


if __name__ == "__main__":
    main()
    # Drivers may keep threads that never end.
    sys.stdout.flush()
    os._exit(0)
