"""The life of one device, from open to close."""

import contextlib
import socket

from backends.base import Patience
from backends.soapy.binding import (
    DIRECTIONS,
    RX,
    TX,
    Device,
    DriverError,
    HostError,
    Library,
    Stream,
    is_driver_missing,
    load_library,
    no_radio,
    not_installed,
    why_not,
)
from backends.soapy.protocol import Open, Opened, SampleRing, Waiting
from backends.soapy.radio_process.apply_settings import apply_settings, blaming, choose_format
from backends.soapy.radio_process.clock import SampleClock
from backends.soapy.radio_process.rx_stream import RxStream
from backends.soapy.radio_process.sample_counted_tx import SampleCountedTransmitter
from backends.soapy.radio_process.streaming import Transmitter, stream
from backends.soapy.radio_process.timestamped_tx import TimestampedTransmitter
from backends.soapy.radio_process.tx_commands import TxCommands
from backends.soapy.radio_process.tx_stream import TxStream
from backends.soapy.settings import DeviceInfo, in_flight

RETRY_S = 0.25, 0.5
"""First and longest pause between attempts to open an absent device; each pause is longer."""
LOOK_S = 0.1
AWAY_S = 1.0
"""Interval at which a device that rejected its settings is checked for its removal."""


class Session:
    """Opens the device of a `request`, streams, and releases everything."""

    def __init__(
        self, request: Open, commands: TxCommands, rx_socket: socket.socket, ring: SampleRing
    ) -> None:
        self._settings = request.settings
        self._patience = request.patience
        self._commands = commands
        self._rx_socket = rx_socket
        self._ring = ring

    def run(self) -> None:
        """Stream until the daemon closes its end. Raises SettingError, DriverError, HostError."""
        args = self._settings.device
        try:
            library = load_library()
        except DriverError as error:
            reason = not_installed(error)
            raise HostError(f'soapy.device: got "{args}", but {reason}') from None
        device = self._made(library)
        if device is None:
            return
        with contextlib.ExitStack() as stack:
            stack.callback(device.close)
            self._stream(library, device, stack)

    def _made(self, library: Library) -> Device | None:
        """Open the device; None: the daemon is gone. Raises DriverError."""
        wait_s, most_s = RETRY_S
        args = self._settings.device
        if refused := no_radio(args):
            raise HostError(refused)
        if self._patience is Patience.REPLUGGED:
            self._wait_until_away(library)
        told = ""
        while not self._commands.is_over:
            try:
                return Device(library, args)
            except DriverError as error:
                if is_driver_missing(library, args, error):
                    raise HostError(why_not(library, args, error)) from None
                if self._patience is Patience.NONE:
                    raise DriverError(why_not(library, args, error)) from None
                # Only for a new error: `why_not` queries all drivers, which takes time.
                is_new, told = str(error) != told, str(error)
                self._commands.say(Waiting(why_not(library, args, error) if is_new else ""))
            self._commands.wait(wait_s)
            wait_s = min(2 * wait_s, most_s)
        return None

    def _wait_until_away(self, library: Library) -> None:
        """Wait until the device is absent: only its absence proves that it was replugged."""
        while not self._commands.is_over and library.enumerate(self._settings.device):
            self._commands.say(Waiting())
            self._commands.wait(AWAY_S)

    def _stream(self, library: Library, device: Device, stack: contextlib.ExitStack) -> None:
        settings, commands = self._settings, self._commands
        gains = apply_settings(device, settings)
        has_time, full_duplex = device.has_time(), device.full_duplex(settings.channel)
        clock = SampleClock(settings.rate_hz, has_time)
        rx, rx_form = self._opened(device, RX, stack)
        piece = max(1, round(settings.block_s * settings.rate_hz), rx.mtu)
        rx_stream = RxStream(
            rx, rx_form, self._ring, self._rx_socket, clock, piece, has_time, settings.rate_hz
        )
        transmitter, transfer = None, 0
        if settings.tx_enabled:
            tx, tx_form = self._opened(device, TX, stack)
            transmitter, transfer = self._transmitter(device, TxStream(tx, tx_form), clock), tx.mtu
        found = DeviceInfo(
            driver=device.driver,
            hardware=device.hardware,
            binding=library.detail,
            rate_hz=settings.rate_hz,
            frequency_hz=settings.frequency_hz,
            full_duplex=full_duplex,
            has_time=has_time,
            receives_in_s=piece / settings.rate_hz,
            tx_transfer_s=transfer / settings.rate_hz,
            in_flight=in_flight(settings, device.driver),
            gains=_told(gains),
        )
        commands.say(Opened(found))
        while not commands.has_begun and not commands.is_over:
            commands.wait(LOOK_S)
        rx_stream.start()
        stream(rx_stream, transmitter, commands, full_duplex, settings.listen_s)

    def _opened(
        self, device: Device, direction: int, stack: contextlib.ExitStack
    ) -> tuple[Stream, str]:
        settings = self._settings
        form = choose_format(device, settings, direction)
        blames = blaming(f"soapy.stream_args: got {settings.stream_args}")
        with blames if settings.stream_args else contextlib.nullcontext():
            opened = device.open_stream(direction, settings.channel, form, settings.stream_args)
        stack.callback(_end, opened)
        return opened, form

    def _transmitter(self, device: Device, tx_stream: TxStream, clock: SampleClock) -> Transmitter:
        settings, full_duplex = self._settings, device.full_duplex(self._settings.channel)
        if device.has_time() and full_duplex:
            return TimestampedTransmitter(self._commands, tx_stream, clock)
        return SampleCountedTransmitter(
            self._commands,
            tx_stream,
            clock,
            leading=settings.leading_transfers,
            in_flight=in_flight(settings, device.driver),
            longest_s=settings.longest_tx_s,
            turnaround_s=0.0 if full_duplex else settings.turnaround_s,
        )


def _end(opened: Stream) -> None:
    # An unplugged device can no longer end a stream.
    with contextlib.suppress(DriverError):
        opened.deactivate()
    with contextlib.suppress(DriverError):
        opened.close()


def _told(gains: dict[int, dict[str, float]]) -> str:
    return ", ".join(
        f"{DIRECTIONS[direction]} {element + ' ' if element else ''}{gain_db:g} dB"
        for direction, by_element in gains.items()
        for element, gain_db in by_element.items()
    )
