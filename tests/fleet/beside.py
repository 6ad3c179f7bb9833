"""What is beside a gateway's parts in this process: a daemon's bus, Zenoh, and notes of both."""

import asyncio
from collections.abc import Awaitable, Callable
from typing import TypeVar

import zenoh
import zmq

from benchmarks.fleet.field import free_endpoint
from benchmarks.peers.zenoh_node import configured
from sdrlinkd.bus import Bus, RuntimeDirectory
from sdrlinkd.config import FleetParams, make_setup, parse_config
from sdrlinkd.control import Control, Verb
from sdrlinkd.errors import UserError
from sdrlinkd.fleet import open_session
from sdrlinkd.fleet.testing import Putter
from sdrlinkd.keyring import new_authority, zenoh_file
from sdrlinkd.link import Delivered, HeardTopic, MessageName, Verdict
from sdrlinkd.wire import Topic
from tests import reported
from tests.bus.programs import REGISTRY, Ingress

T = TypeVar("T")
CDR = b"\0\1\0\0data"
OWN, ROBOT = 7, 2
CERTIFICATE = zenoh_file(new_authority(), "all", 1)
"""A file of Zenoh's."""
PATIENCE_S = 10.0
"""Time in s after which a wait was in vain."""


async def until(is_so: Callable[[], bool]) -> None:
    """Wait until `is_so()`, which no event tells."""
    async with asyncio.timeout(PATIENCE_S):
        while not is_so():  # noqa: ASYNC110 (it has none)
            await asyncio.sleep(0.005)


async def until_found(ask: Callable[[], Awaitable[T]], is_so: Callable[[T], bool]) -> T:
    """What `ask` finds, once that is so."""
    async with asyncio.timeout(PATIENCE_S):
        while not is_so(found := await ask()):  # noqa: ASYNC110
            await asyncio.sleep(0.02)
    return found


class Daemon:
    """The bus and the control socket of gateway OWN's daemon, with a link that takes notes."""

    def __init__(self, folder, more=""):
        (folder / "zenoh.json5").write_text(CERTIFICATE)
        text = (
            f'auto = true\nnamespace = "robot_{OWN}"\nregistry = "{REGISTRY}"\n{more}\n'
            f'[bus]\nruntime_dir = "{folder}"\n'
        )
        self.folder = folder
        self.setup = make_setup(parse_config(text, "test"), folder)
        self.snapshot = reported.snapshot(OWN)
        self.declared = []
        """What programs have declared."""
        self.heard = []
        """What robots say of their topics."""
        self.refused = set()
        """Names of topics that it lets nobody declare."""
        self.start()

    def start(self):
        self.ingress = Ingress()
        self._context = zmq.Context()
        self._directory = RuntimeDirectory(self.folder)
        self._bus = Bus(self._context, self._directory, self.setup, self.ingress)
        self._control = Control(self._context, self._directory)
        self._control.serve(
            {
                "status": Verb(lambda _: self.snapshot, ""),
                "declare": Verb(self._declare, ""),
                "declared": Verb(lambda _: self.heard, ""),
            }
        )

    def stop(self):
        self._bus.close()
        self._control.close()
        self._context.destroy(linger=0)
        self._directory.close()

    def hears(self, *robots, topics=(), **more):
        """From its next report on, it hears these robots, well unless `more` says otherwise."""
        near = [reported.neighbor(each, **more) for each in robots]
        self.snapshot = reported.snapshot(OWN, neighbors=near, topics=topics)

    async def is_heard(self):
        """Wait until a program listens."""
        async with asyncio.timeout(PATIENCE_S):
            await self._bus.has_consumer.wait()

    def bring(self, number, topic="odom", robot=ROBOT, kind="nav_msgs/msg/Odometry", **more):
        """Hand over a message of a robot."""
        age_s = more.pop("age_s", 0.25)
        told = {"lost_pdus": 0, "origin_at": None, "heard_at": 0.0, "hops_left": 0, "snr_db": None}
        told |= {"name": MessageName(1, number % 256, number, 0, is_numbered=True)}
        payload = more.pop("payload", CDR + bytes((number,)))
        # A number on the air for each name.
        topic_id = 1 + sum(topic.encode()) % 200
        heard = HeardTopic(topic_id, topic, kind)
        told |= {"topic_id": topic_id, "number": number, "topic": heard}
        self._bus.publish(Delivered(src=robot, payload=payload, **{**told, **more}), age_s, 77)

    def stop_message(self, topic="odom", robot=ROBOT):
        self._bus.publish_stop(robot, HeardTopic(3, topic, "nav_msgs/msg/Odometry"), CDR)

    def tell(self, receipt, topic_id, *what):
        """Tell what became of a message with this receipt's id."""
        self._bus.tell(Verdict(receipt, topic_id, ROBOT, *what))

    def accept(self, *names, kind="nav_msgs/msg/Odometry"):
        """Take messages of these topics from now on."""
        for name in names:
            number = 100 + len(self._bus.names_in())
            self._bus.accept(name, Topic(number, self.setup.name_on_air(name), kind))
        self._bus.announce({})

    @property
    def taken(self):
        """(bus topic, payload, wishes, published at in ns) of what programs have sent."""
        names = self._bus.names_in()
        return [(names[number], *more) for number, *more in self.ingress.taken]

    def _declare(self, arguments):
        self.declared.append((arguments["name"], arguments["type"]))
        if arguments["name"] in self.refused:
            raise UserError("not this one")
        self.accept(arguments["name"], kind=arguments["type"])
        return {}


class Network:
    """A session of the product that routes, and a plain node of Zenoh beside it."""

    def __init__(self, protocol="tcp"):
        self.endpoint = free_endpoint(protocol)
        self.near = None
        self.far = None
        self.came = []
        """What the plain node has heard."""
        self._kept = []

    async def open(self, folder):
        params = FleetParams(name="mine", listen=[self.endpoint])
        self.near = await open_session(params, folder)
        return self

    async def join(self, *keys):
        """The plain node joins, and hears what is put at `keys`."""
        config = zenoh.Config.from_json5(CERTIFICATE)
        config = configured(config, mode="client", connect=[self.endpoint])
        self.far = await asyncio.to_thread(zenoh.open, config)
        for key in keys:
            self._kept.append(self.far.declare_subscriber(key, self.came.append))
        # Its answer comes after the other session has taken the declarations.
        await asyncio.to_thread(lambda: list(self.far.liveliness().get("any")))

    async def part(self):
        """The plain node leaves."""
        if self.far is not None:
            await asyncio.to_thread(self.far.close)
            self.far = None

    async def ask(self, key, payload=None, attachment=None):
        """The answers to a query of the plain node, which does not wait until its time is over."""

        def asked():
            most_s = 2 * PATIENCE_S
            found = self.far.get(key, payload=payload, attachment=attachment, timeout=most_s)
            return [each.ok for each in found if each.ok is not None]

        async with asyncio.timeout(PATIENCE_S):
            return await asyncio.to_thread(asked)

    def token(self, key):
        """Set up a token of the plain node; returns it."""
        self._kept.append(self.far.liveliness().declare_token(key))
        return self._kept[-1]

    async def close(self):
        await self.part()
        if self.near is not None:
            await self.near.close()


class Notes:
    """A session that notes what is put, declared and asked, and reaches whom a test wants."""

    def __init__(self):
        self.is_reached = True
        self.zid = "ab12"
        self.puts = []
        """(key, payload, attachment, class) of each put; of publishers also what they say."""
        self.has_room = True
        self.takes = {}
        """What takes what comes at a key."""
        self.tokens = []
        self.publishers = []
        """(key, class, encoding, kept) of those that are there."""
        self.answers = []
        self.asked = []

    def put(self, key, payload, attachment, qos, encoding=None):
        if self.has_room:
            self.puts.append((key, payload, attachment, qos))
        return self.has_room

    def publisher(self, key, qos, encoding, kept):
        told = (key, qos, encoding, kept)
        self.publishers.append(told)
        return Putter(
            lambda payload, attachment: self.put(key, payload, attachment, qos),
            lambda: self.publishers.remove(told),
        )

    def subscribe(self, key, take):
        self.takes[key] = take
        return lambda: self.takes.pop(key)

    serve = watch = subscribe

    def token(self, key):
        self.tokens.append(key)
        return lambda: self.tokens.remove(key)

    async def get(self, key, within_s):
        self.asked.append((key, within_s))
        return self.answers
