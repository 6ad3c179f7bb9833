"""Programs of other accounts of this computer, where this one may start them."""

import os
import socket
from collections.abc import Callable

from sdrlinkd.client import MessageRefusedError, NoDaemonError, RefusedError

NOBODY = 65534
OTHER_ACCOUNTS = (NOBODY,) if os.geteuid() == 0 else ()
"""Only root may become another one."""


def status_for(account, port, path="/"):
    """The HTTP status that a program of `account` gets for a WebSocket at a port."""
    request = (
        f"GET {path} HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nUpgrade: websocket\r\n"
        "Connection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
        "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"
        "Sec-WebSocket-Protocol: foxglove.sdk.v1\r\n\r\n"
    )
    child = os.fork()
    if child:
        # An exit code is an octet.
        return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) + 300
    try:
        os.setuid(account)
        with socket.create_connection(("127.0.0.1", port), 20) as client:
            client.sendall(request.encode())
            status = int(client.recv(4096).split()[1])
        os._exit(status - 300 if status >= 300 else 0)
    finally:
        os._exit(255)


def done_by(account: int, groups: list[int], work: Callable[[], object]) -> bool:
    """Whether a program of `account`, which is in `groups` alone, can do `work`.

    It cannot if that raises what clients raise where a door is closed.
    """
    child = os.fork()
    if child:
        code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
        assert code in (0, 1), code
        return code == 0
    try:
        os.setgroups(groups)
        os.setgid(groups[0] if groups else account)
        os.setuid(account)
        work()
        os._exit(0)
    except (NoDaemonError, RefusedError, MessageRefusedError, OSError):
        os._exit(1)
    finally:
        os._exit(255)
