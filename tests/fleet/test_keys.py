"""Keys and attachments: whatever robots, operators or strangers write into them."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sdrlinkd.client import MessageName
from sdrlinkd.fleet import (
    TERMS,
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
from sdrlinkd.fleet.testing import Token
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
    assert KEYS.messages(2) == "sdrlink/mine/robot_2/**"
    assert KEYS.all_messages == "sdrlink/mine/**"
    assert KEYS.gateways == "sdrlink/mine/@gw/**"
    assert KEYS.every_gateway("status") == "sdrlink/mine/@gw/*/status"
    assert KEYS.bridges(7) == "sdrlink/mine/@gw/7/bridge"
    assert (KEYS.routes, KEYS.all_sent) == ("sdrlink/mine/@route/*", "sdrlink/mine/@sent/*")


@pytest.mark.parametrize(
    ("read", "key", "found"),
    [
        (KEYS.read_message, "sdrlink/mine/robot_254/a%20b/c", (254, "a b/c")),
        (KEYS.read_message, "sdrlink/mine/robot_0/odom", (0, "odom")),
        (KEYS.read_message, "sdrlink/mine/robot_255/odom", None),
        (KEYS.read_message, "sdrlink/mine/robot_2", None),
        (KEYS.read_message, "sdrlink/mine/robot_02/odom", None),
        (KEYS.read_message, "sdrlink/other/robot_2/odom", None),
        (KEYS.read_message, "a/sdrlink/mine/robot_2/odom", None),
        (KEYS.read_robot, "sdrlink/mine/@sent/robot_254", 254),
        (KEYS.read_robot, "sdrlink/mine/@sent/robot_255", None),
        (KEYS.read_robot, "robot_2/a", None),
        (KEYS.read_gateway, "sdrlink/mine/@gw/7/status", 7),
        (KEYS.read_gateway, "sdrlink/mine/@gw/254/status", 254),
        (KEYS.read_gateway, "sdrlink/mine/@gw/1000/status", None),
        (KEYS.read_gateway, "sdrlink/mine/@gw/7", None),
        (KEYS.read_gateway, "sdrlink/mine/@gw/x/status", None),
        (KEYS.read_gateway, "a/sdrlink/mine/@gw/7/status", None),
        (KEYS.read_token, "sdrlink/mine/@gw/1000", None),
        (KEYS.read_token, "sdrlink/mine/@gw/100/robot_254", (100, 254, False)),
        (KEYS.read_token, "sdrlink/mine/@gw/7/robot_255", None),
        (KEYS.read_token, "sdrlink/mine/@gw/7/status", None),
        (KEYS.read_token, "sdrlink/mine/@gw/x", None),
        (KEYS.read_token, "a/sdrlink/mine/@gw/7", None),
    ],
)
def test_keys_are_read_back_and_others_are_none(read, key, found):
    assert read(key) == found


@pytest.mark.parametrize(
    ("token", "is_there"),
    [(Token(7), True), (Token(7, 0), False), (Token(7, bridges=True), False)],
)
def test_a_token_says_that_a_gateway_is_there_or_more(token, is_there):
    assert token.is_there == is_there


def test_the_longest_attachment_that_is_read():
    for size, is_read in ((1024, True), (1025, False)):
        octets = encode(Claim(7, 1, 0.5))
        # A map may say more than is known.
        head, rest = octets[0], octets[1:]
        more = b"\xa1x" + b"\xda" + (size - len(octets) - 5).to_bytes(2, "big")
        long = bytes((head + 1,)) + rest + more
        long += b"y" * (size - len(long))
        assert (read_claim(long) == Claim(7, 1, 0.5)) == is_read
        assert is_passed(long) == is_read


def test_a_claim_beats_another_by_term_score_and_lower_id():
    claims = [Claim(7, 1, 0.5), Claim(9, 1, 0.6), Claim(8, 1, 0.6), Claim(3, 2, 0.1)]
    for i, one in enumerate(claims):
        assert [one.beats(other) for other in claims] == [i > k for k in range(len(claims))]
    assert read_claim(encode(Claim(7, 1, float("nan")))) is None
    assert read_claim(encode(claims[0])) == claims[0]
    fate = Fate(7, "cmd_vel", "desk", None, "taken", "why")
    assert read_fate(encode(fate)) == fate
    assert read_command(encode(Command("desk", 3, "a/msg/B", "bulk", 5.0))).ls == 5.0


@pytest.mark.slow
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
    assert Passed(7, sq=9).name is None
    assert Passed(7, e=2).name is None
    assert Passed(7, b=1, e=2, pn=0, sq=9, ps=4).name == MessageName(1, 2, 0, 4)


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
    assert claim is None or not claim.beats(claim)


@law(300)
@given(st.integers(0, TERMS - 1), st.integers(0, TERMS - 1), st.floats(-1, 2), st.integers(0, 3))
def test_of_two_claims_one_beats_the_other(term, other, its_score, gw):
    """Also where the terms have gone around, or are as far apart as can be."""
    for far in (other, (term + TERMS // 2) % TERMS, (term + TERMS // 2 - 1) % TERMS):
        one, two = Claim(9, term, 0.5), Claim(gw, far, its_score)
        assert one.beats(two) != two.beats(one)
    assert Claim(gw, (term + 1) % TERMS, -0.5).beats(Claim(9, term, 2))


def test_what_a_gateway_puts_is_never_an_operators_command_whatever_else_it_says():
    told = encode(Passed(7))
    assert is_passed(told)
    # A field that nobody knows, with a name that is no text.
    strange = bytes((told[0] + 1,)) + told[1:] + b"\xa2\xfep\x01"
    assert read_passed(strange) == Passed(7)
    assert is_passed(strange)
    assert not is_passed(encode(Command("ann", 7)))
    assert not is_passed(b"")
    assert not is_passed(None)
