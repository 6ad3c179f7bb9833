"""Reports the service's state to systemd over its datagram socket (sd_notify(3))."""

import os
import socket


class Notifier:
    """Sends states to $NOTIFY_SOCKET; does nothing if the variable is not set."""

    def __init__(self) -> None:
        address = os.environ.pop("NOTIFY_SOCKET", "")
        # An abstract socket's name begins with NUL, which the environment variable writes as "@".
        self._address = "\0" + address[1:] if address.startswith("@") else address
        interval_us = os.environ.pop("WATCHDOG_USEC", "")
        for_us = os.environ.pop("WATCHDOG_PID", str(os.getpid())) == str(os.getpid())
        self.watchdog_s = int(interval_us) / 1e6 if interval_us.isdigit() and for_us else None

    def ready(self) -> None:
        """Report that the service is up."""
        self._send("READY=1", wait_s=1.0)

    def extend(self, seconds: float) -> None:
        """Request `seconds` more for starting or stopping."""
        self._send(f"EXTEND_TIMEOUT_USEC={seconds * 1e6:.0f}")

    def stopping(self) -> None:
        """Report that the service is stopping."""
        self._send("STOPPING=1")

    def alive(self) -> None:
        """Feed the watchdog: the daemon is alive."""
        self._send("WATCHDOG=1")

    def status(self, line: str) -> None:
        """Set the status line that `systemctl status` shows."""
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
