"""Addresses to listen at, as people write them."""

from sdrlinkd.errors import UserError

MOST_PORT = 65535


def address(text: str, example: str) -> tuple[str, int]:
    """(host, port) of `--listen HOST:PORT`. Raises UserError, which shows the example."""
    host, _, port = text.rpartition(":")
    if not host or not port.isdecimal() or int(port) > MOST_PORT:
        raise UserError(f'--listen: got "{text}"; allowed: HOST:PORT, such as {example}')
    return host.strip("[]"), int(port)
