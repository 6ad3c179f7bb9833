"""Makes the stored corpus: `python -m tests.fuzz.corpus`. Each file begins a search."""

import json
from pathlib import Path
from random import Random

import numpy as np

from backends.testing import protocol
from sdrlinkd.adapters import knows, to_cdr
from sdrlinkd.calls import Kind, Packet
from sdrlinkd.fleet import Claim, Command, Fate, Passed, encode
from sdrlinkd.fleet.testing import Attachment, Node, Qos, Role
from sdrlinkd.keyring import KeyFile, StoredKey, key_file_text
from sdrlinkd.link import ClockParams, Outcome, RepeatParams
from sdrlinkd.pdulink import to_gnu_radio
from sdrlinkd.pdulink.testing import pmt
from sdrlinkd.wire import build_records
from tests.fuzz.doors import TYPES as DOOR_TYPES
from tests.fuzz.doors import a_state
from tests.fuzz.mutate import RECORDS, Source, one_pdu
from tests.fuzz.targets import KEY, PDU_SIZE
from tests.link.world import make_link, next_burst
from tests.ros.types import made

CORPUS = Path(__file__).parent / "corpus"
SHIPPED = Path(__file__).parents[2] / "etc"


def link_inputs() -> list[bytes]:
    """What a robot sends in half a second: messages, fragments, declarations, records."""
    link = make_link(
        1, pdu_size=PDU_SIZE, beacon_s=0.1, clock=ClockParams(), repeat=RepeatParams(),
        has_numbers=True, hop_limit=3,
    )  # fmt: skip
    sent: list[bytes] = []
    for i in range(50):
        now = 0.01 * i
        link.submit(i % 3, b"\0\1\0\0" + bytes(i % 7 * 30), now)
        link.handle_timers(now)
        burst = next_burst(link, now)
        if burst is not None:
            link.confirm(burst, Outcome.SENT, now)
            sent.append(b"".join(burst.pdus))
    return sent[:24]


def door_inputs() -> dict[str, list[bytes]]:
    """Those of the programs around the daemon, and of its disk."""
    chance = Random(5)
    twist = b'{"linear": {"x": 1.5, "y": 0}, "angular": {"z": -1e-3}}'
    claim, fate = Claim(2, 7, 0.5), Fate(2, "cmd_vel", "ann", 7, "taken")
    attachments = (
        encode(Command("ann", 7, "geometry_msgs/msg/Twist", "urgent", 300.0)),
        encode(Passed(3, "nav_msgs/msg/Odometry", b=5, e=7, pn=9, age=100)), b"",
    )  # fmt: skip
    keys = b"sdrlink/fleet/robot_2/cmd_vel", b"sdrlink/fleet/@gw/3/robot_2", b"sdrlink/@route/x"
    token = Node(0, "f" * 32, "nav").endpoint(
        5, Role.PUBLISHER, "/robot_2/cmd_vel", "geometry_msgs::msg::dds_::Twist_",
        "RIHS01_" + "ab" * 32, Qos(),
    )  # fmt: skip
    keys_file = KeyFile(key=[StoredKey(kid=0, secret=KEY.secret, created="2026-11-25")])
    packet = Packet(Kind.REQUEST, 7, 9, "/set", body=b"\0\1\0\0abcd").build()
    return {
        "foxglove": [
            bytes((n,)) + b"/robot_2/cmd_vel\xff" + body
            for n, body in enumerate((twist, to_cdr(made(DOOR_TYPES[1], chance), DOOR_TYPES[1])))
        ],
        "zenoh": [
            b"\xff".join((key, attachment, encode(claim if n % 2 else fate)))
            for n, (key, attachment) in enumerate(zip(keys, attachments, strict=True))
        ],
        "rmw_zenoh": [
            b"\xff".join((token.encode(), Attachment(3, 5, bytes(16)).build(), packet)),
            b"0/robot_2/cmd_vel/geometry_msgs::msg::dds_::Twist_/RIHS01_ab\xff\xff" + packet,
        ],
        "state": [a_state(), a_state(0), key_file_text(keys_file).encode()],
        "cdr": [
            bytes((n,)) + to_cdr(made(kind, chance), kind)
            for n, kind in enumerate(DOOR_TYPES)
            if knows(kind)
        ],
    }


def inputs() -> dict[str, list[bytes]]:
    """The inputs of each target."""
    chance, source = Random(1), Source()
    ours = link_inputs()
    meta = {
        "global": {"core:datatype": "ci8", "core:sample_rate": 1e6, "core:version": "1.2.6"},
        "captures": [{"core:sample_start": 0, "core:frequency": 433e6}],
        "annotations": [{"core:sample_start": 3, "core:sample_count": 4, "core:label": "gap"}],
    }
    envelope = [
        b"/robot_1/odom\0",
        b'{"q": 1, "ty": "nav_msgs/msg/Odometry", "t": 5}',
        b"\0\1\0\0ab",
    ]
    packed = [b"/x\0", b"\x01\x82\xa1q\x01\xa2id\xa1a", b"\0\1\0\0"]
    values = (True, -5, "name", [1, "two", None], {"key": 2.5}, np.arange(4, dtype=np.uint8))
    air = (
        protocol.encode(protocol.Question()), protocol.encode(protocol.Bye(token=5)),
        b"\x81\xa4type\xa5Hello", b"\x82\xa4type\xa4Done\xa4seen\x05",
    )  # fmt: skip
    return {
        "pdu": [pdu[:PDU_SIZE] for pdu in ours] + [one_pdu(chance) for _ in range(8)],
        "records": [build_records([record]) for record in RECORDS] + [build_records(RECORDS[:4])],
        "link": [*ours, b"".join(ours[:8])],
        "sealed": [source.sealed(chance) for _ in range(12)],
        "bus": [b"\xff".join(envelope), b"\xff".join(packed), b"\xff".join(envelope[:2])],
        "config": [
            path.read_bytes()[:6000] for path in sorted(SHIPPED.glob("*.toml"))
        ] + [b'namespace = "robot_2"\nbackend = "loopback"\n[modem]\nrate_hz = "1 Msps"\n'],
        "pmt": [pmt.dumps(value) for value in values] + [to_gnu_radio(ours[0][:PDU_SIZE])],
        "sigmf": [json.dumps(meta).encode(), b'{"global": {}}'],
        "hub": list(air),
        **door_inputs(),
    }  # fmt: skip


def write() -> int:
    """Write the corpus anew; returns the number of files."""
    n = 0
    for target, found in inputs().items():
        folder = CORPUS / target
        folder.mkdir(parents=True, exist_ok=True)
        for old in folder.iterdir():
            old.unlink()
        for i, data in enumerate(found):
            (folder / f"{i:02}").write_bytes(data)
            n += 1
    return n


if __name__ == "__main__":
    print(f"{write()} inputs in {CORPUS}")  # noqa: T201
