"""What other programs on this computer and on its networks may send, and what is on its disk."""

import json
import tempfile
from itertools import count
from pathlib import Path

from sdrlink_ros import cdr as ros_cdr

from sdrlinkd.adapters import from_cdr
from sdrlinkd.adapters.testing import ros2_types
from sdrlinkd.calls import Packet, of_action, understood
from sdrlinkd.errors import CdrError, UserError
from sdrlinkd.fleet import (
    Commands,
    Election,
    Keys,
    Order,
    is_passed,
    read_claim,
    read_command,
    read_fate,
    read_passed,
)
from sdrlinkd.fleet.testing import (
    Attachment,
    read_data_key,
    read_endpoint,
    robot_in,
    ros_type,
)
from sdrlinkd.foxglove import Command, judge
from sdrlinkd.foxglove.testing import cdr_of
from sdrlinkd.keyring import KeyState, parse_key_file
from sdrlinkd.sealing import Key
from sdrlinkd.wire import N_TICKS
from tests.ros.types import fields_of

LEASE_S = 1.0
MOST_ROBOT = 254
DIVIDER = b"\xff"
TYPES = (
    "geometry_msgs/msg/Twist", "nav_msgs/msg/Odometry", "tf2_msgs/msg/TFMessage",
    "sensor_msgs/msg/PointCloud2", "diagnostic_msgs/msg/DiagnosticArray", "std_msgs/msg/Bool",
    "visualization_msgs/msg/MarkerArray", "std_msgs/msg/Empty",
)  # fmt: skip
KEY = Key(0, bytes(range(32)))


def foxglove(data: bytes) -> None:
    """The announcement of a command, and the command: its type by the first octet."""
    head, _, body = data.partition(DIVIDER)
    name = head[1:].decode("utf-8", "replace")
    command = judge(name, name, "json", ["*"])
    assert isinstance(command, str) or 0 <= command.robot <= MOST_ROBOT
    kind = TYPES[(head[0] if head else 0) % len(TYPES)]
    for encoding in ("json", "cdr"):
        try:
            cdr = cdr_of(Command(2, "/cmd_vel", kind, encoding), body)
        except UserError:
            continue
        from_cdr(cdr, kind)


class Zenoh:
    """A gateway that takes keys, attachments, claims and fates of anybody."""

    def __init__(self) -> None:
        self._keys = Keys("fleet")
        self._n = count()
        self._commands = Commands(1)
        self._election = Election(1, LEASE_S, 0.0)

    def __call__(self, data: bytes) -> None:
        """Take a key, an attachment and a payload, divided by the octet 0xFF."""
        key, attachment, payload, *_ = [*data.split(DIVIDER, 2), b"", b""]
        now = 0.1 * next(self._n)
        text = key.decode("utf-8", "replace")
        told = self._keys.read_message(text)
        for robot in (told.robot if told else None, self._keys.read_robot(text)):
            assert robot is None or 0 <= robot <= MOST_ROBOT
        self._keys.read_gateway(text)
        self._keys.read_token(text)
        if (passed := read_passed(attachment)) is not None:
            assert is_passed(attachment)
            assert passed.name is None or passed.e is not None
        self._take(attachment, payload, now)
        self._claim(payload, now)

    def _take(self, attachment: bytes, payload: bytes, now: float) -> None:
        commands = self._commands
        command = read_command(attachment)
        if command is not None:
            taken = commands.take(2, "cmd_vel", command, payload, now, 0.0, leads=True)
            if isinstance(taken, Order) and command.n is not None:
                again = commands.take(2, "cmd_vel", command, payload, now, 0.0, leads=True)
                assert not isinstance(again, Order), "a command is taken once"
        fate = read_fate(payload)
        if fate is not None:
            commands.told(2, fate, now)
        assert len(commands.due(now)) <= 1

    def _claim(self, payload: bytes, now: float) -> None:
        """Whatever is claimed, there is one leader a lease and a back-off after the last claim."""
        claim, election = read_claim(payload), self._election
        election.hear(0.5, now)
        if claim is None:
            return
        election.claimed(claim, now)
        for tenth in range(1, 30):
            election.poll(now + 0.1 * tenth)
        assert election.leads
        self._election = Election(1, LEASE_S, now + LEASE_S)


def rmw_zenoh(data: bytes) -> None:
    """A token or key of a node, its attachment, and a call or a message of an action."""
    key, attachment, payload, *_ = [*data.split(DIVIDER, 2), b"", b""]
    text = key.decode("utf-8", "replace")
    endpoint = read_endpoint(text)
    assert endpoint is None or ros_type(endpoint.kind)
    found = read_data_key(0, text)
    if found is not None and (at := robot_in(found.name)) is not None:
        assert at[0] >= 0
    Attachment.parse(attachment)
    packet = Packet.parse(payload)
    assert packet is None or Packet.parse(packet.build()) == packet
    understood(payload)
    of_action(payload)


def state(data: bytes) -> None:
    """The file with a key's numbers, and the key file."""
    with tempfile.TemporaryDirectory() as name:
        kept = KeyState(Path(name), 1)
        path = Path(name) / f"robot-1-key-{KEY.fingerprint.hex()[:16]}.json"
        path.write_bytes(data)
        found = kept.load([KEY])
        assert all(0 <= floor <= N_TICKS for floor in found.floors.values())
        assert all(0 <= robot <= MOST_ROBOT for robot in found.known)
    try:
        parse_key_file(data, "keys.toml")
    except UserError:
        return


def cdr(data: bytes) -> None:
    """A message for DDS, its type by the first octet: what passes can be read."""
    kind = TYPES[(data[0] if data else 0) % len(TYPES)]
    octets = data[1:]
    if not FITS[kind](octets):
        return
    try:
        from_cdr(octets, kind)
    except CdrError as error:
        assert "Invalid string length 0" in str(error), error  # noqa: PT017


FITS = {
    kind: ros_cdr.fits(fields_of(kind.replace("/msg/", "/")), fields_of)
    for kind in TYPES
    if kind in ros2_types().fielddefs
}


def a_state(floor: int = 5000) -> bytes:
    """A state with a true checksum."""
    with tempfile.TemporaryDirectory() as name:
        kept = KeyState(Path(name), 1)
        kept.begin(KEY, None)
        (path,) = Path(name).glob("*.json")
        return json.dumps({**json.loads(path.read_bytes()), "check": "", "floor": floor}).encode()
