"""Who comes in at a TCP port: tokens, origins, and whose program it is at the other end."""

import hmac
import os
import secrets
import socket
from collections.abc import Iterable
from ipaddress import ip_address
from pathlib import Path
from urllib.parse import SplitResult, parse_qs, urlsplit

ROOT = 0
_TABLES = (Path("/proc/net/tcp"), Path("/proc/net/tcp6"))
_LOCAL, _REMOTE, _UID = 1, 2, 7
"""Columns of the kernel's tables."""


def token_from(variable: str) -> str:
    """The token in an environment variable, or else a new one that nobody guesses."""
    return os.environ.get(variable) or secrets.token_urlsafe(18)


def is_token(given: str, token: str) -> bool:
    """Whether the token was given; takes as long whatever was given."""
    return hmac.compare_digest(given.encode(), token.encode())


def token_in(query: str) -> str:
    """The token in the query of an address; empty if there is none."""
    return parse_qs(query).get("token", [""])[0]


def split(url: str) -> SplitResult:
    """The parts of an address; empty ones of what is none."""
    try:
        return urlsplit(url)
    except ValueError:
        return urlsplit("")


def is_local(host: str) -> bool:
    """Whether only programs of this computer reach what listens at `host`."""
    try:
        return ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def is_local_name(host: str) -> bool:
    """Whether a Host header, with or without a port, names this computer."""
    return is_local(split(f"//{host}").hostname or "")


def is_allowed(origin: str, allowed: Iterable[str]) -> bool:
    """Whether a page of this origin may come in: one of this computer, or one that is `allowed`."""
    parts = split(origin)
    is_own = parts.scheme in ("http", "https") and is_local(parts.hostname or "")
    return is_own or origin in allowed


def is_ours(peer: tuple[str, int], own: tuple[str, int]) -> bool:
    """Whether the program at the other end of a connection is of our account, or root's.

    Only the kernel of this computer knows; of a program elsewhere, nobody does.
    """
    ends = [_ends(*peer), _ends(*own)]
    for table in _TABLES:
        try:
            lines = table.read_text().splitlines()[1:]
        except OSError:
            continue
        for line in lines:
            columns = line.split()
            if columns[_LOCAL] in ends[0] and columns[_REMOTE] in ends[1]:
                return int(columns[_UID]) in (os.geteuid(), ROOT)
    return False


def _ends(host: str, port: int) -> set[str]:
    """An end of a connection as the kernel writes it, as IPv4 and as IPv6."""
    address = ip_address(host.partition("%")[0])
    mapped = getattr(address, "ipv4_mapped", None) or address
    found = {_hex(mapped.packed, port)}
    if mapped.version == 4:
        found.add(_hex(bytes(10) + b"\xff\xff" + mapped.packed, port))
    return found


def _hex(packed: bytes, port: int) -> str:
    # Words in the order of this computer.
    words = (packed[at : at + 4] for at in range(0, len(packed), 4))
    return "".join(f"{socket.ntohl(int.from_bytes(each)):08X}" for each in words) + f":{port:04X}"
