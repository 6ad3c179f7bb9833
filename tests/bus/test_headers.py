"""Headers: what consumers are told of a message, what is read of refused ones, and size limits."""

from types import SimpleNamespace

import msgspec
import pytest

from sdrlinkd.bus import fields_of
from sdrlinkd.bus.testing import Intake, announcement, decode, header_of, wanted_of
from sdrlinkd.config import make_setup, parse_config
from sdrlinkd.errors import EnvelopeError
from sdrlinkd.link import Delivered, HeardTopic, MessageName, TopicPolicy
from sdrlinkd.localtime import LocalTimes
from sdrlinkd.wire import Topic
from tests.bus.programs import REGISTRY, Ingress

TOPIC, CDR = b"/robot_1/odom\0", b"\0\1\0\0data"


def delivered(name="map", series=20, is_numbered=True):
    return Delivered(
        2, 20, CDR, 5, 7, 1.0, 1.5, 3, 12.5, 1.25, 1.625, series,
        HeardTopic(20, name, "a/msg/B"), MessageName(9, 300, 70, 4, is_numbered),
    )  # fmt: skip


def test_a_consumer_is_told_all_that_is_known_of_a_message():
    times = LocalTimes(11, 12, 13, 14)
    fields = dict(zip(("published_ns", "published_error_us", "sampled_ns", "sampled_error_us"),
                      ("tl", "eb", "ts", "es"), strict=True))  # fmt: skip
    told = msgspec.to_builtins(header_of(delivered(), 0.75, 99, times))
    assert told == {
        "s": 2, "n": 5, "tr": 99, "ty": "a/msg/B", "g": 7, "h": 3, "age": 750_000, "sn": 12.5,
        "dw": 250_000, "dr": 250_000, "da": 125_000, "b": 9, "e": 300, "pn": 70, "ps": 4,
        **{short: getattr(times, long) for long, short in fields.items()},
    }  # fmt: skip
    sealed = msgspec.to_builtins(header_of(delivered()._replace(is_sealed=True), 0.75, 99, times))
    assert sealed == {**told, "se": True}
    nothing = LocalTimes(*[None] * 4)
    told = msgspec.to_builtins(
        header_of(delivered("@5/map", 21, is_numbered=False), None, 99, nothing)
    )
    assert told == {
        "s": 5, "v": 2, "sr": 21, "n": 5, "tr": 99, "ty": "a/msg/B", "g": 7, "h": 3, "sn": 12.5,
        "b": 9, "e": 300, "sq": 70, "ps": 4,
    }  # fmt: skip


def sized(size):
    """A header of `size` octets."""
    header = b'{"x":"' + b"x" * (size - 8) + b'"}'
    assert len(header) == size
    return header


def test_headers_and_keys_have_a_largest_size():
    assert decode([TOPIC, sized(256), CDR])[1] is not None
    with pytest.raises(EnvelopeError, match="header of 257 bytes; at most 256"):
        decode([TOPIC, sized(257), CDR])
    for key in ("x" * 32, "é" * 16):
        assert decode([TOPIC, msgspec.json.encode({"k": key}), CDR])[1].k == key
    for key in ("x" * 33, "é" * 16 + "x"):
        with pytest.raises(EnvelopeError, match="`k` has more than 32"):
            decode([TOPIC, msgspec.json.encode({"k": key}), CDR])


def test_of_a_refused_message_is_read_what_can_be():
    def wanted(header):
        return wanted_of([TOPIC, header, CDR])

    for pack in (msgspec.json.encode, lambda each: b"\1" + msgspec.msgpack.encode(each)):
        for fields, id_, dst in (
            ({"id": "a.1", "d": 0, "p": 999}, "a.1", 0), ({"d": 255}, "", 255),
            ({"id": 5, "d": 256}, "", None), ({"id": "x" * 256, "d": -1}, "x" * 256, None),
            ({"id": "x" * 257, "d": "5"}, "", None), ({}, "", None),
        ):  # fmt: skip
            assert wanted(pack(fields)) == (id_, dst, fields)
    for header in (b"", b"\1", b"\1\x81", b"{", b"[1]", b"\2\x80", b'{"a":' * 2000, b"\xff"):
        assert wanted(header) == ("", None, {})
    for frames in ([], [TOPIC]):
        assert wanted_of(frames) == ("", None, {})
    assert fields_of([TOPIC, sized(4096)]) != {}
    assert fields_of([TOPIC, sized(4097)]) == {}


def setup(tmp_path, more=""):
    return make_setup(parse_config(f'robot_id = 1\nregistry = "{REGISTRY}"\n{more}', "x"), tmp_path)


@pytest.mark.parametrize(
    ("more", "policy", "most", "over"),
    [
        ("", {}, None, "tx_too_big"),
        ("", {"max_bytes": 99}, 99, "tx_size_cap"),
        ("[queue]\nmax_bytes = 77\n", {"max_bytes": 99}, 77, "tx_overflow_new"),
        ("[queue]\nmax_bytes = 77\n", {"compress": "zstd"}, 1 << 20, "tx_too_big"),
        ("[queue]\nmax_bytes = 77\n", {"compress": "zstd", "max_bytes": 99}, 99, "tx_size_cap"),
        ("[bus]\nmax_message_bytes = 66\n", {"max_bytes": 99}, 66, "tx_too_big"),
        ("[bus]\nmax_message_bytes = 99\n", {"max_bytes": 99}, 99, "tx_too_big"),
    ],
)
def test_the_announcement_names_the_least_limit(tmp_path, more, policy, most, over):
    made = setup(
        tmp_path, more if "[bus]" in more else more + f"[bus]\nmax_message_bytes = {1 << 20}\n"
    )
    topic = made.registry.topics[1]
    octets = announcement(made, {"/robot_1/odom": topic}, {1: TopicPolicy(**policy)}, "abcd")
    assert octets[:1] == b"\1"
    welcome = msgspec.msgpack.decode(octets[1:])
    assert (welcome["daemon"], welcome["envelope"], welcome["boot"]) == ("sdrlinkd", [1], "abcd")
    assert welcome["topics"] == ["/robot_1/odom"] == list(welcome["takes"])
    told = welcome["takes"]["/robot_1/odom"]
    assert (told["ty"], told["over"]) == ("nav_msgs/msg/Odometry", over)
    assert told["most"] == (made.largest if most is None else most)


def test_what_is_filtered_first_has_no_limit_but_the_buses(tmp_path):
    made = setup(tmp_path, "[queue]\nmax_bytes = 77\n")
    filtered = SimpleNamespace(
        config=made.config, transforms={"odom"}, has_numbers=True, largest=50
    )
    plain = SimpleNamespace(config=made.config, transforms=set(), has_numbers=True, largest=50)
    topics = {"/odom": Topic(1, "odom", "a/msg/B")}
    for each, most in ((filtered, made.config.bus.max_message_bytes), (plain, 50)):
        octets = announcement(each, topics, {1: TopicPolicy(max_bytes=60)}, "")
        told = msgspec.msgpack.decode(octets[1:])["takes"]["/odom"]
        assert told["most"] == most
    assert told["key"] == f"link.pdu_size = {made.config.link.pdu_size}"
    without = SimpleNamespace(config=made.config, transforms=set(), has_numbers=False, largest=50)
    octets = announcement(without, topics, {}, "")
    key = msgspec.msgpack.decode(octets[1:])["takes"]["/odom"]["key"]
    assert key.endswith("(with 2047: 518670 B)")


def test_messages_are_taken_under_each_name_that_was_accepted(tmp_path):
    ingress, told = Ingress(), []
    intake = Intake(setup(tmp_path), ingress, told.append)
    topic = Topic(40, "arm/state", "a/msg/B")
    frames = [b"/robot_1/arm/state\0", b"{}", CDR]
    intake.take(frames)
    assert ingress.refused == [("tx_unknown_topic", None, "", None)]
    assert "/robot_1/arm/state" in intake.last_bad
    assert intake.accept("/robot_1/arm/state", topic)
    assert not intake.accept("/robot_1/arm/state", topic)
    intake.take(frames)
    assert [each[:2] for each in ingress.taken] == [(40, CDR)]
    assert (intake.names[40], intake.topics["/robot_1/arm/state"]) == ("/robot_1/arm/state", topic)
    assert told == [], "nobody wanted a receipt"


def test_a_refused_message_of_no_topic_of_ours_gets_its_receipt_here(tmp_path):
    ingress, told = Ingress(), []
    intake = Intake(setup(tmp_path), ingress, told.append)
    for topic, header, reason in (
        (b"/x\0", {"id": "a.1"}, "tx_unknown_topic"), (b"/x\0", {"id": "a.1", "d": 4},
         "tx_unknown_topic"), (TOPIC, {"id": "a.1", "p": 128, "d": 0}, "tx_bad_envelope"),
    ):  # fmt: skip
        intake.take([topic, msgspec.json.encode(header), CDR])
        receipt = told.pop()
        assert (receipt.id, receipt.topic) == ("a.1", topic[:-1].decode())
        assert (receipt.d, receipt.fate, receipt.reason) == (
            header.get("d", 255),
            "dropped",
            reason,
        )
    assert "127" in intake.last_bad, "what is wrong with the wish, not with its octets"
    intake.take([b"/" + b"n" * 400 + b"\0", msgspec.json.encode({"id": "a.2"}), CDR])
    assert told.pop().topic == "/" + "n" * 255
    assert intake.last_bad.startswith("/nnn") or "/nnn" in intake.last_bad
    assert len(intake.last_bad) <= 240
