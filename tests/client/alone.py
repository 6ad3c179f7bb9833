"""A program that has only the client and pyzmq, for any Python: `alone.py RUNTIME_DIR`."""
# ruff: noqa: T201

import asyncio
import sys

from sdrlinkd.client import (
    AsyncPublisher,
    AsyncSubscriber,
    ControlClient,
    MessageRefusedError,
    NoDaemonError,
    Publisher,
    Subscriber,
)

CDR = b"\0\1\0\0"
ODOM, HEARD = "/robot_1/odom", "/rx_robot_1/odom"


def blocking(runtime_dir):
    with Subscriber(HEARD, runtime_dir=runtime_dir) as heard, Publisher(runtime_dir) as out:
        name = out.send(ODOM, CDR + b"one", qos="latency", dst=1, receipt=True)
        assert heard.receive(20).payload == CDR + b"one"
        told = out.receipt(20)
        assert (told.id, told.fate) == (name, "delivered"), told
        try:
            out.send("/robot_9/odom", CDR)
        except MessageRefusedError as error:
            print(error)
    with ControlClient(runtime_dir) as control:
        assert control.ask("hello")["daemon"] == "sdrlinkd"
    try:
        with Publisher(runtime_dir + "/nobody", timeout_s=0.1) as out:
            out.send(ODOM, CDR)
    except NoDaemonError as error:
        print(error)


async def in_asyncio(runtime_dir):
    heard, out = AsyncSubscriber(HEARD, runtime_dir=runtime_dir), AsyncPublisher(runtime_dir)
    async with heard, out:
        name = await out.send(ODOM, CDR + b"two", dst=1, receipt=True)
        assert (await heard.receive()).payload == CDR + b"two"
        told = await out.receipt(20)
        assert (told.id, told.fate) == (name, "delivered"), told
        assert await out.receipt(0.01) is None
        try:
            await out.send(ODOM, CDR, qos="fast")
        except MessageRefusedError as error:
            print(error)
    for make in (AsyncPublisher, AsyncSubscriber):
        try:
            async with make(runtime_dir=runtime_dir + "/nobody", timeout_s=0.1) as nobody:
                await nobody.send(ODOM, CDR)
        except NoDaemonError as error:
            print(error)


blocking(sys.argv[1])
asyncio.run(in_asyncio(sys.argv[1]))
print("modules", *sorted({name.split(".")[0] for name in sys.modules} & {"msgspec", "numpy"}))
