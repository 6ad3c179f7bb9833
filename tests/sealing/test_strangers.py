"""What people are told about robots whose PDUs do not open."""

import re
from math import inf

import pytest

from sdrlinkd.sealing import Key, words_of
from sdrlinkd.sealing.testing import HeldKeys, Strangers
from sdrlinkd.wire import KeyTold
from tests.sealing.team import KEY, NEXT

OTHER = Key(0, bytes(32))


def strangers(mode="seal", keys=(KEY, NEXT)):
    return Strangers(HeldKeys(list(keys), mode, b"") if keys else None)


def tells(key, is_auth=False):
    return KeyTold(key.kid, is_auth, key.fingerprint[:4])


@pytest.mark.parametrize(
    ("note", "words"),
    [
        (
            lambda s: s.closed(5, 2, 10.0),
            "robot 5 is heard, but uses key 2, which .*installed: 0, 1",
        ),
        (
            lambda s: s.closed(5, 1, 10.0),
            "robot 5 is heard, but its PDUs do not open with key 1; compare",
        ),
        (lambda s: s.clear(5, 10.0), "robot 5 is heard, but sends in the clear"),
        (lambda s: s.old(5, 10.0), "PDUs of robot 5 have old numbers"),
        (lambda s: s.late(5, 10.0), "PDUs of robot 5 come later than they say"),
        (
            lambda s: s.tells(5, tells(OTHER), 10.0),
            " …; ours: ".join(words_of(each.fingerprint[:4]) for each in (OTHER, KEY)),
        ),
        (lambda s: s.tells(5, KeyTold(3, False, b"abcd"), 10.0), "another key 3.*; ours: none"),
        (
            lambda s: s.tells(5, tells(NEXT, True), 10.0),
            "robot 5 is heard, but uses the mode auth, and this robot seal",
        ),
    ],
)
def test_each_fault_is_told_for_half_a_minute(note, words):
    found = strangers()
    assert found.notices(10.0) == []
    note(found)
    for now in (10.0, 39.9):
        (notice,) = found.notices(now)
        assert re.search(words, notice)
    assert found.notices(40.0) == []


def test_a_key_record_explains_why_pdus_do_not_open():
    found = strangers()
    found.closed(5, 0, 10.0)
    found.tells(5, tells(KEY), 0.0)
    (notice,) = found.notices(20.0)
    assert "although it has our key 0: they are damaged or forged" in notice
    (notice,) = found.notices(30.0)
    assert "do not open with key 0" in notice, "what was told is too old"
    found.tells(5, tells(KEY), 40.0)
    assert found.notices(50.0) == [], "the same key, and nothing that does not open"
    found.closed(5, 0, 50.0)
    assert len(found.notices(50.0)) == 1


def test_one_that_opens_is_no_stranger_but_for_what_is_late_or_old():
    found = strangers()
    found.opened(5)
    assert found.by_src == {}
    found.closed(5, 0, 10.0)
    found.clear(5, 10.0)
    found.tells(5, tells(OTHER), 10.0)
    assert len(found.notices(10.0)) == 1
    found.opened(5)
    assert found.notices(10.0) == []
    found.late(5, 10.0)
    found.opened(5)
    assert "later than they say" in found.notices(10.0)[0]
    found.old(5, 10.0)
    assert "old numbers" in found.notices(10.0)[0], "the worse fault"
    found.clear(5, 10.0)
    assert "in the clear" in found.notices(10.0)[0]


def test_without_keys_a_robot_that_seals_is_told():
    found = strangers(keys=())
    assert found.key_due_at == inf
    found.closed(5, 1, 10.0)
    assert found.key_due_at == inf, "there is none to tell"
    (notice,) = found.notices(39.9)
    assert notice.startswith("robot 5 is heard, but seals its PDUs, and this robot has no key")
    found.tells(6, tells(KEY), 20.0)
    assert [each[:7] for each in found.notices(25.0)] == ["robot 5", "robot 6"]


def test_no_more_than_eight_robots_are_named_by_ascending_id():
    found = strangers()
    for src in range(20, 0, -1):
        found.clear(src, 1.0)
    assert [int(each.split()[1]) for each in found.notices(1.0)] == list(range(1, 9))


def test_our_key_is_told_soon_and_not_too_often():
    found = strangers()
    assert found.key_due_at == inf
    found.closed(5, 0, 10.0)
    assert found.key_due_at == 10.0
    found.key_told(11.0)
    assert found.key_due_at == inf, "nothing has come since"
    found.closed(6, 0, 11.0)
    assert found.key_due_at == inf
    found.closed(6, 0, 12.0)
    assert found.key_due_at == 16.0
    found.closed(6, 0, 17.0)
    assert found.key_due_at == 17.0
