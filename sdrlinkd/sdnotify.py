"""Telling systemd how the service is (sd_notify(3)), over its datagram socket."""

import os
import socket


class Notifier:
    """Sends states to $NOTIFY_SOCKET; silent when the service manager asks for none."""

    def __init__(self) -> None:
        address = os.environ.pop("NOTIFY_SOCKET", "")
        # An abstract socket's name begins with NUL, which the environment tx_windows "@".
        self._address = "\0" + address[1:] if address.startswith("@") else address
        interval_us = os.environ.pop("WATCHDOG_USEC", "")
        for_us = os.environ.pop("WATCHDOG_PID", str(os.getpid())) == str(os.getpid())
        self.watchdog_s = int(interval_us) / 1e6 if interval_us.isdigit() and for_us else None

    def ready(self) -> None:
        """Tell that the service is up."""
        self._send("READY=1", wait_s=1.0)

    def extend(self, seconds: float) -> None:
        """Ask for more time: starting, or stopping, may last so many seconds more."""
        self._send(f"EXTEND_TIMEOUT_USEC={seconds * 1e6:.0f}")

    def stopping(self) -> None:
        """Tell that the service is on its way down."""
        self._send("STOPPING=1")

    def alive(self) -> None:
        """Feed the watchdog: the daemon is alive."""
        self._send("WATCHDOG=1")

    def status(self, line: str) -> None:
        """Tell the line that `systemctl status` shows."""
        self._send(f"STATUS={line}")

    def _send(self, state: str, wait_s: float = 0.0) -> None:
        if not self._address:
            return
        with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC) as sock:
            sock.settimeout(wait_s)
            try:
                sock.sendto(state.encode(), self._address)
            except OSError:
                return
