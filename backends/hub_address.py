"""Where a hub is: in a folder of this computer, or at a port of another one."""

import re
import socket
from pathlib import Path
from typing import NamedTuple

from backends.base import BackendError
from backends.params import EtherParams

AIR, SKY = "air.sock", "sky.sock"
PATIENCE_S = 2.0
"""Longest wait for another computer to accept a connection."""
MAX_PORT = 65534
"""The hub's second socket has the next port."""
_HOST = re.compile(r"[^\s/]+")


class HubAddress(NamedTuple):
    """The endpoints of a hub's two sockets, and how people name it."""

    air: str
    sky: str
    name: str
    start: str
    """The command that starts a hub there."""
    is_remote: bool


def hub_in(directory: Path) -> HubAddress:
    """The hub whose sockets are in `directory`."""
    return HubAddress(
        f"ipc://{directory / AIR}",
        f"ipc://{directory / SKY}",
        str(directory),
        f"sdrlink-ether --dir {directory}",
        is_remote=False,
    )


def hub_at(text: str, key: str) -> HubAddress:
    """The hub at `text`, HOST:PORT. Raises BackendError that cites `key`."""
    host, _, port = text.rpartition(":")
    if not _HOST.fullmatch(host) or not port.isdecimal() or not 0 < int(port) <= MAX_PORT:
        raise BackendError(
            f'{key}: got "{text}"; allowed: HOST:PORT with a port from 1 to {MAX_PORT}, such as '
            "192.168.1.5:47900"
        )
    return HubAddress(
        f"tcp://{host}:{int(port)}",
        f"tcp://{host}:{int(port) + 1}",
        text,
        f"sdrlink-ether --listen 0.0.0.0:{int(port)}, on that computer",
        is_remote=True,
    )


def hub_of(ether: EtherParams) -> HubAddress:
    """The hub that [ether] names. Raises BackendError."""
    return hub_at(ether.hub, "ether.hub") if ether.hub else hub_in(Path(ether.dir))


def is_listening(hub: HubAddress) -> bool:
    """Whether a hub's socket file exists, or its port accepts a connection within PATIENCE_S."""
    if not hub.is_remote:
        return Path(hub.air.removeprefix("ipc://")).exists()
    host, _, port = hub.name.rpartition(":")
    try:
        with socket.create_connection((host, int(port)), PATIENCE_S):
            return True
    except OSError:
        return False
