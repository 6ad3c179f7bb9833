"""Keys of a fleet on Zenoh (fleet document, section 1)."""

import re
from typing import NamedTuple
from urllib.parse import quote, unquote

ROOT = "sdrlink"
_ROBOT = re.compile(r"robot_(0|[1-9][0-9]{0,2})\Z")
MOST_ROBOTS = 254
_MOST_DIGITS = 3
_BRIDGE = "bridge"


class TopicKey(NamedTuple):
    """The robot and the topic of a message."""

    robot: int
    topic: str


class Token(NamedTuple):
    """That a gateway is there; or that it hears a robot, or bridges."""

    gateway: int
    robot: int | None = None
    bridges: bool = False

    @property
    def is_there(self) -> bool:
        """Whether it says no more than that the gateway is there."""
        return self.robot is None and not self.bridges


class Keys:
    """The keys of fleet `name`."""

    def __init__(self, name: str) -> None:
        self.prefix = f"{ROOT}/{name}"

    def message(self, robot: int, topic: str) -> str:
        """Of messages of a topic of a robot, and of commands to it."""
        # A chunk that begins with @ would not match wildcards, and empty chunks are not allowed.
        chunks = [quote(each, safe="_.-") for each in topic.split("/") if each]
        return "/".join([self.prefix, f"robot_{robot}", *chunks])

    def messages(self, robot: int) -> str:
        """Of all messages of one robot, and of commands to it."""
        return f"{self.prefix}/robot_{robot}/**"

    @property
    def all_commands(self) -> str:
        """Of all messages of all robots, and of commands to them, and of nothing else."""
        return f"{self.prefix}/robot_$*/**"

    @property
    def all_messages(self) -> str:
        """Of all messages of all robots."""
        return f"{self.prefix}/**"

    def gateway(self, gateway: int, what: str = "") -> str:
        """Of a gateway's token, or of `what` can be queried of it."""
        return f"{self.prefix}/@gw/{gateway}" + (f"/{what}" if what else "")

    def every_gateway(self, what: str) -> str:
        """Of `what` can be queried of each gateway."""
        return f"{self.prefix}/@gw/*/{what}"

    @property
    def gateways(self) -> str:
        """Of the tokens of all gateways, and of the robots that they hear."""
        return f"{self.prefix}/@gw/**"

    def hears(self, gateway: int, robot: int) -> str:
        """Of the token that a gateway hears a robot."""
        return self.gateway(gateway, f"robot_{robot}")

    def bridges(self, gateway: int) -> str:
        """Of the token that a gateway sends to its robots what others put."""
        return self.gateway(gateway, _BRIDGE)

    def route(self, robot: int) -> str:
        """Of the gateways' claims to a robot."""
        return f"{self.prefix}/@route/robot_{robot}"

    @property
    def routes(self) -> str:
        """Of the gateways' claims to all robots."""
        return f"{self.prefix}/@route/*"

    def sent(self, robot: int) -> str:
        """Of what becomes of commands to a robot."""
        return f"{self.prefix}/@sent/robot_{robot}"

    @property
    def all_sent(self) -> str:
        """Of what becomes of commands to all robots."""
        return f"{self.prefix}/@sent/*"

    def read_message(self, key: str) -> TopicKey | None:
        """The robot and topic in the key of a message; None for any other key."""
        prefix, _, rest = key.partition(f"{self.prefix}/")
        robot, _, topic = rest.partition("/")
        number = _robot(robot)
        if prefix or number is None or not topic:
            return None
        return TopicKey(number, unquote(topic, errors="replace"))

    def read_robot(self, key: str) -> int | None:
        """The robot in the last chunk of a key; None if there is none."""
        return _robot(key.rpartition("/")[2])

    def read_gateway(self, key: str) -> int | None:
        """The gateway whose answer has this key; None for any other key."""
        prefix, _, rest = key.partition(f"{self.prefix}/@gw/")
        gateway, _, what = rest.partition("/")
        is_one = not prefix and what and gateway.isdecimal() and len(gateway) <= _MOST_DIGITS
        return int(gateway) if is_one else None

    def read_token(self, key: str) -> Token | None:
        """What a token says by its key; None for any other key."""
        prefix, _, rest = key.partition(f"{self.prefix}/@gw/")
        gateway, _, told = rest.partition("/")
        if prefix or not gateway.isdecimal() or len(gateway) > _MOST_DIGITS:
            return None
        token = Token(int(gateway), _robot(told), bridges=told == _BRIDGE)
        return None if told and token.is_there else token


def _robot(chunk: str) -> int | None:
    found = _ROBOT.match(chunk)
    return int(found[1]) if found and int(found[1]) <= MOST_ROBOTS else None
