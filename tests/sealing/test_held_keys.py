"""Which key seals and which ones open, and what must be on disk for it."""

import pytest

from sdrlinkd.sealing import Key, Memory, Remembered
from sdrlinkd.sealing.testing import HeldKeys, Numbers, Peers, Rotation
from sdrlinkd.wire import N_TICKS, KeyTold
from tests.sealing.team import KEY, NEXT

THIRD = Key(2, bytes(range(64, 96)))
LONGEST_S, QUIET_S, PRESENT_S = 600.0, 60.0, 10.0


def told(key):
    return KeyTold(key.kid, False, key.fingerprint[:4])


def test_the_key_in_use_before_seals_and_else_the_first():
    for in_use, own, further in (
        (b"", KEY, NEXT), (KEY.fingerprint, KEY, NEXT), (NEXT.fingerprint, NEXT, None),
        (THIRD.fingerprint, KEY, NEXT),
    ):  # fmt: skip
        rotation = Rotation([KEY, NEXT], in_use)
        assert (rotation.own, rotation.further) == (own, further)


def changing(*robots):
    """A rotation whose first look was at 100 s, and the robots that it knows to have the next."""
    rotation = Rotation([KEY, NEXT], b"")
    assert not rotation.look(100.0, {})
    for robot in robots:
        rotation.told(robot, told(NEXT))
    return rotation


def test_the_next_key_is_used_once_all_who_are_present_have_it():
    rotation = changing(1)
    assert not rotation.look(101.0, {}), "nobody is here"
    assert not rotation.look(101.0, {1: 101.0, 2: 101.0 - PRESENT_S + 0.1})
    rotation.told(2, told(THIRD))
    rotation.opened(2, KEY.kid, 101.0)
    assert not rotation.look(101.0, {1: 101.0, 2: 101.0})
    rotation.opened(2, NEXT.kid, 101.0)
    assert rotation.look(101.0, {1: 101.0, 2: 101.0})
    assert (rotation.own, rotation.further) == (NEXT, None)
    one = changing(1)
    assert one.look(101.0, {1: 101.0, 2: 101.0 - PRESENT_S}), "robot 2 is not here any more"


def test_a_lost_robot_is_waited_for_only_so_long():
    rotation = changing()
    assert not rotation.look(100.0 + LONGEST_S - 0.1, {1: 699.0})
    assert rotation.look(100.0 + LONGEST_S, {1: 699.0})
    assert rotation.own == NEXT


def used(at=1000.0):
    """A rotation that has changed to the next key at a time."""
    rotation = changing(1)
    assert rotation.look(at, {1: at})
    return rotation


def test_the_old_key_opens_until_nobody_uses_it():
    rotation = used()
    assert not rotation.look(1000.0 + QUIET_S - 0.1, {})
    rotation.opened(1, KEY.kid, 1050.0)
    rotation.opened(1, NEXT.kid, 1100.0)
    assert not rotation.look(1050.0 + QUIET_S - 0.1, {})
    assert rotation.look(1050.0 + QUIET_S, {})
    assert (rotation.keys, rotation.retired) == ([NEXT], {KEY.fingerprint})
    assert not rotation.look(2000.0, {}), "nothing changes any more"


def test_nor_longer_than_ten_minutes():
    rotation = used()
    for at in range(1000, 1000 + round(LONGEST_S)):
        rotation.opened(1, KEY.kid, at)
        assert not rotation.look(at + 0.5, {}), at
    assert rotation.look(1000.0 + LONGEST_S, {})
    assert rotation.keys == [NEXT]


def test_other_keys_begin_the_change_anew():
    rotation = changing(1)
    rotation.install([KEY, THIRD])
    assert (rotation.own, rotation.further) == (KEY, THIRD)
    assert not rotation.look(5000.0, {1: 5000.0}), "robot 1 had another one"
    assert not rotation.look(5000.0 + LONGEST_S - 1, {})
    rotation.told(1, told(THIRD))
    assert rotation.look(5100.0, {1: 5100.0})
    rotation.install([KEY, NEXT])
    assert rotation.own == KEY, "the one in use is not among them"


def test_the_ciphers_follow_the_keys():
    held = HeldKeys([KEY, NEXT], "auth", NEXT.fingerprint)
    assert (held.own.key, held.is_changing, held.all) == (NEXT, True, [KEY, NEXT])
    assert held.told(KEY) == KeyTold(0, True, KEY.fingerprint[:4])
    own = held.own
    held.install([NEXT])
    assert held.own is own, "it goes on"
    assert (held.is_changing, list(held.by_kid)) == (False, [1])
    assert not held.look(0.0, {})
    held.install([NEXT, THIRD])
    assert not held.look(0.0, {})
    held.rotation.told(3, told(THIRD))
    assert held.look(1.0, {3: 1.0})
    assert held.own.key == THIRD
    assert not held.look(1.0 + QUIET_S, {}), "the same key seals"
    assert list(held.by_kid) == [2]
    assert HeldKeys([KEY], "seal", b"").told(KEY) == KeyTold(0, False, KEY.fingerprint[:4])


def memory(remembered=None, keys=(KEY,)):
    remembered = remembered or Remembered({KEY.fingerprint: 0})
    held = HeldKeys(list(keys), "seal", remembered.in_use)
    numbers = Numbers(remembered.floors.get(held.own.key.fingerprint, 0))
    peers = Peers(lambda _src, _kid: 0)
    return Memory(remembered, held, numbers, peers), held, numbers, peers


def test_the_floor_moves_ahead_of_the_numbers():
    kept, _, numbers, _ = memory()
    assert kept.at_stop().floors == {KEY.fingerprint: 0}
    numbers.clock(0.0)
    wanted = kept.wanted(0.0)
    assert wanted == Remembered({KEY.fingerprint: 1920}, {KEY.fingerprint: {}}, KEY.fingerprint)
    kept.not_written("No space")
    assert "cannot be written to disk: No space" in kept.failed
    assert numbers.is_out(0.0)
    kept.written(wanted)
    assert (kept.failed, kept.on_disk) == ("", wanted)
    assert kept.wanted(39.9) is None
    assert kept.wanted(40.0).floors == {KEY.fingerprint: 1920 + 1280}
    kept.written(wanted._replace(in_use=NEXT.fingerprint, floors={NEXT.fingerprint: 9000}))
    assert numbers.floor == 1920, "the floor of another key is not ours"


def test_what_was_heard_of_each_robot_is_kept_and_no_floor_is_lowered():
    before = Remembered(
        {KEY.fingerprint: 5000, NEXT.fingerprint: 70},
        {KEY.fingerprint: {4: 10, 5: 300}, THIRD.fingerprint: {8: 1}},
        KEY.fingerprint, frozenset((b"old",)), frozenset((9,)),
    )  # fmt: skip
    kept, held, _, peers = memory(before, (KEY, NEXT))
    peers.of(5).window(KEY.kid).take(200, 0)
    peers.of(4).window(KEY.kid).take(20, 0)
    peers.of(6).window(NEXT.kid).take(30, 0)
    at_stop = kept.at_stop()
    assert at_stop == Remembered(
        {KEY.fingerprint: 5000 + 960, NEXT.fingerprint: 70},
        {KEY.fingerprint: {4: 20, 5: 300}, NEXT.fingerprint: {6: 30}, THIRD.fingerprint: {8: 1}},
        KEY.fingerprint, frozenset((b"old",)), frozenset((4, 5, 6, 8, 9)),
    )  # fmt: skip
    kept.written(at_stop._replace(floors={KEY.fingerprint: 99_000}))
    assert kept.at_stop().floors[KEY.fingerprint] == 99_000
    held.rotation.retired.add(b"new")
    assert kept.wanted(0.0).retired == {b"old", b"new"}
    assert kept.wanted(0.0).floors[b"new"] == N_TICKS, "its numbers are lost; it stays out of use"
    assert kept.wanted(0.0).resumed == {b"new"}, "and vouches for no other key"


def test_what_is_on_disk_of_keys_that_are_installed_is_added():
    kept, *_ = memory(Remembered({KEY.fingerprint: 50}, {KEY.fingerprint: {1: 2}}))
    kept.add(
        Remembered(
            {KEY.fingerprint: 40, NEXT.fingerprint: 7},
            {KEY.fingerprint: {1: 1}, NEXT.fingerprint: {3: 4}},
        )
    )
    assert kept.on_disk.floors == {KEY.fingerprint: 50, NEXT.fingerprint: 7}
    assert kept.on_disk.newest == {KEY.fingerprint: {1: 2}, NEXT.fingerprint: {3: 4}}
    kept.add(Remembered({KEY.fingerprint: 60}))
    assert kept.on_disk.floors[KEY.fingerprint] == 60


@pytest.mark.parametrize("floor", [0, 1000, N_TICKS - 100])
def test_numbers_begin_behind_what_was_on_disk(floor):
    """960 units of T are 30 s."""
    numbers, begin = Numbers(floor), min(floor + 960, N_TICKS) if floor else 0
    assert (numbers.floor, numbers.first, numbers.newest) == (begin, begin, begin)
    assert numbers.take(0.0, 0) is None, "nothing is on disk"
    assert not numbers.fits(0.0, 0, 1)
    assert numbers.is_out(0.0)
    assert numbers.clock(2.0) == begin / 32 + 2.0
    assert numbers.offset(7.0) == numbers.offset(0.0)
    wanted = numbers.wanted_floor(2.0)
    assert wanted == (min(begin + 64 + 1920, N_TICKS) if begin < N_TICKS else None)
    if wanted:
        numbers.move_floor(wanted)
        numbers.move_floor(wanted - 50)
        assert numbers.floor == wanted
        assert numbers.take(0.0, 5) == begin
        assert numbers.take(0.0, 5) is None, "each seq once in a T"
        assert numbers.take(0.03, 5) is None
        assert (numbers.fits(0.0, 6, 255), numbers.fits(0.0, 6, 256)) == (True, False)
        assert numbers.take(1 / 32, 5) == begin + 1
        assert numbers.newest == begin + 1
        assert numbers.take(-1.0, 9) is None, "before this life"


def test_numbers_that_are_not_ours_are_foreign():
    numbers = Numbers(0)
    numbers.move_floor(100_000)
    numbers.clock(0.0)
    assert numbers.is_foreign(0, 0)
    for at in range(100):
        assert numbers.take(float(at), 1) == 32 * at
        assert numbers.take(float(at), 2) == 32 * at
    newest = 32 * 99
    for ticks, seq, is_foreign in (
        (newest, 1, False), (newest, 2, False), (newest, 3, True), (newest - 1, 1, True),
        (newest + 1, 1, True), (newest - 320, 1, False), (newest - 320, 3, True),
        (newest - 321, 3, False), (0, 3, False),
    ):  # fmt: skip
        assert numbers.is_foreign(ticks, seq) == is_foreign, (ticks, seq)
    numbers.begin_anew()
    assert numbers.clock(5.0) == (newest + 1) / 32
    assert numbers.take(5.0, 1) == newest + 1


def test_another_key_goes_on_with_t_for_half_of_its_life():
    for used_s, floor, begin in (
        (10.0, 0, 320), (10.0, 320, 320), (10.0, 321, 321 + 960),
        (N_TICKS / 64 - 1, 0, N_TICKS // 2 - 32), (N_TICKS / 64, 0, 0), (N_TICKS / 64, 5, 965),
    ):  # fmt: skip
        numbers = Numbers(0)
        numbers.move_floor(N_TICKS)
        numbers.clock(0.0)
        assert numbers.take(used_s, 3) == round(32 * used_s)
        numbers.change_key(floor)
        assert (numbers.newest, numbers.floor) == (begin, begin)
        assert numbers.take(used_s, 4) is None
        assert not numbers.fits(used_s + 1, 3, 1)
        numbers.move_floor(N_TICKS)
        goes_on = begin == round(32 * used_s)
        assert numbers.clock(used_s) == (used_s if goes_on else begin / 32)
        assert numbers.fits(used_s, 3, 1) != goes_on, "its seq is used in this T"
        assert not numbers.is_used_up(used_s)


def test_a_key_is_used_up_at_its_last_number():
    numbers = Numbers(N_TICKS - 960 - 32)
    numbers.move_floor(2 * N_TICKS)
    assert numbers.take(0.0, 0) == N_TICKS - 32
    assert not numbers.is_used_up(0.99)
    assert numbers.take(0.99, 0) == N_TICKS - 1
    assert numbers.is_used_up(1.0)
    assert numbers.take(1.0, 0) is None
    assert numbers.wanted_floor(0.0) is None
