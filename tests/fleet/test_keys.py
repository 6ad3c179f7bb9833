"""Keys and attachments: whatever robots, operators or strangers write into them."""

from hypothesis import given
from hypothesis import strategies as st

from sdrlinkd.client import MessageName
from sdrlinkd.fleet import (
    Claim,
    Command,
    Fate,
    Keys,
    Passed,
    TopicKey,
    encode,
    is_passed,
    read_claim,
    read_command,
    read_fate,
    read_passed,
)
from tests.laws import law

KEYS = Keys("mine")
numbers = st.integers(-(1 << 63), (1 << 64) - 1)
texts = st.text(st.characters(exclude_categories=["Cs"]))


def test_keys_are_those_of_the_document():
    assert KEYS.message(2, "camera/image") == "sdrlink/mine/robot_2/camera/image"
    assert KEYS.message(2, "/odom") == "sdrlink/mine/robot_2/odom"
    assert KEYS.gateway(7) == "sdrlink/mine/@gw/7"
    assert KEYS.gateway(7, "status") == "sdrlink/mine/@gw/7/status"
    assert KEYS.hears(7, 2) == "sdrlink/mine/@gw/7/robot_2"
    assert KEYS.route(2) == "sdrlink/mine/@route/robot_2"
    assert KEYS.sent(2) == "sdrlink/mine/@sent/robot_2"
    assert KEYS.read_token("sdrlink/mine/@gw/7") == (7, None, False)
    assert KEYS.read_token("sdrlink/mine/@gw/7/robot_2") == (7, 2, False)
    assert KEYS.read_token(KEYS.bridges(7)) == (7, None, True)
    assert KEYS.read_robot("sdrlink/mine/@route/robot_2") == 2


@law(300)
@given(st.integers(0, 254), st.text(min_size=1))
def test_any_topic_is_one_key_and_is_read_back(robot, topic):
    key = KEYS.message(robot, topic)
    assert not set(key) & set("*$?#@")
    assert "//" not in key
    chunks = [each for each in topic.split("/") if each]
    expected = TopicKey(robot, "/".join(chunks)) if chunks else None
    plain = topic.encode(errors="replace").decode() == topic
    assert not plain or KEYS.read_message(key) == expected


@law(300)
@given(st.text() | st.from_regex(r"sdrlink/mine/(@gw|@route|robot_[0-9]+)/.*"))
def test_any_other_key_is_refused_or_read(key):
    for read in (KEYS.read_message, KEYS.read_robot, KEYS.read_token):
        read(key)


def test_a_message_of_a_gateway_is_no_command():
    passed = Passed(7, "nav_msgs/msg/Odometry", 1, 2, 3, age=400, sn=20.5)
    assert is_passed(encode(passed))
    assert read_passed(encode(passed)) == passed
    assert passed.name == MessageName(1, 2, 3)
    assert not is_passed(encode(Command("desk", 3)))
    assert not is_passed(None)
    assert read_command(None) == read_command(b"") == Command()
    assert read_command(encode(Command("desk", 3, q="soon"))) is None
    assert read_command(encode(Command("desk", 3, ls=-1.0))) is None


def test_the_name_of_a_message_of_a_source_that_told_no_numbers():
    assert Passed(7, e=2, sq=9).name == MessageName(None, 2, 9, is_numbered=False)
    assert Passed(7, stop=True).name is None


@law(300)
@given(
    st.binary(max_size=60)
    | st.builds(Claim, st.integers(0, 254), numbers, st.floats()).map(encode)
    | st.builds(Fate, st.integers(0, 254), texts, texts, numbers, texts).map(encode)
)
def test_any_octets_are_read_or_none(octets):
    for read in (read_passed, read_command, read_claim, read_fate, is_passed):
        read(octets)
    claim = read_claim(octets)
    assert claim is None or claim.rank == claim.rank
