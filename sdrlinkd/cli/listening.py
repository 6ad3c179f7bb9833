"""Where a program listens, as people write it."""

from sdrlinkd.errors import UserError

MOST_PORT = 65535


def host_and_port(text: str, key: str, example: str) -> tuple[str, int]:
    """(host, port) from `HOST:PORT`. Raises UserError that cites `key`."""
    host, _, port = text.rpartition(":")
    if not host or not port.isdecimal() or int(port) > MOST_PORT:
        raise UserError(f'{key}: got "{text}"; allowed: HOST:PORT, such as {example}')
    return host.strip("[]"), int(port)
