"""ZeroMQ sockets at endpoints that users configure."""

import zmq

from backends.base import BackendError

Socket = zmq.Socket[bytes]


def open_endpoint(
    context: zmq.Context[Socket], kind: int, endpoint: str, key: str, binds: bool, ahead: int
) -> Socket:
    """Open a socket; a leading @ binds, > connects (as in czmq), otherwise `binds` decides.

    At most `ahead` messages wait in it. Raises BackendError that cites `key`.
    """
    socket = context.socket(kind)
    socket.setsockopt(zmq.LINGER, 0)
    socket.setsockopt(zmq.RECONNECT_IVL, 20)
    socket.setsockopt(zmq.RECONNECT_IVL_MAX, 500)
    socket.setsockopt(zmq.SNDHWM, ahead)
    plain = endpoint.lstrip("@>")
    try:
        if endpoint.startswith("@") or (binds and not endpoint.startswith(">")):
            socket.bind(plain)
        else:
            socket.connect(plain)
    except zmq.ZMQError as error:
        socket.close()
        raise BackendError(
            f'{key}: got "{endpoint}", which is unusable ({error.strerror}); allowed: a '
            'ZeroMQ endpoint such as "tcp://127.0.0.1:52001" or "ipc:///tmp/air", with @ before '
            "it to bind and > to connect"
        ) from None
    return socket
