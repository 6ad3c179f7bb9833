"""A wide-area network for TCP: `python -m benchmarks.peers.wan LISTEN_PORT PORT DELAY_MS`.

What comes at LISTEN_PORT of this host goes to PORT, and back, each way DELAY_MS later. Nothing is
lost and nothing overtakes, as over TCP.
"""

import asyncio
import sys

CHUNK = 65536


async def _carry(
    reader: asyncio.StreamReader, writer: asyncio.StreamWriter, delay_s: float
) -> None:
    """Carry one direction until its sender closes."""
    loop = asyncio.get_running_loop()
    while octets := await reader.read(CHUNK):
        loop.call_later(delay_s, writer.write, octets)
    loop.call_later(delay_s, writer.close)


async def _run(listen: int, to: int, delay_s: float) -> None:
    async def joined(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        far_reader, far_writer = await asyncio.open_connection("127.0.0.1", to)
        async with asyncio.TaskGroup() as group:
            group.create_task(_carry(reader, far_writer, delay_s))
            group.create_task(_carry(far_reader, writer, delay_s))

    server = await asyncio.start_server(joined, "127.0.0.1", listen)
    sys.stdout.write("listening\n")
    sys.stdout.flush()
    await server.serve_forever()


def main() -> None:
    """Carry until killed; prints a line once it listens."""
    listen, to, delay_ms = map(float, sys.argv[1:])
    asyncio.run(_run(int(listen), int(to), 1e-3 * delay_ms))


if __name__ == "__main__":
    main()
