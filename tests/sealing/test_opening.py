"""Two robots' sealing, PDU by PDU: what opens, what is used of it, and what leaves later."""

import pytest

from sdrlinkd.errors import PduError
from sdrlinkd.sealing import Remembered, Sealing, SecurityParams
from sdrlinkd.wire import (
    N_TICKS,
    Contact,
    Entry,
    Frame,
    KeyTold,
    Met,
    PduBuilder,
    Stamp,
    build_records,
    delayed,
    depends_on_start,
    parse_sealed,
    postponed,
)
from tests.sealing.team import KEY, NEXT

SIZE, INNER = 78, 64
DAY_S = 86_400


def made(own_id=1, keys=(KEY,), floor=0, **params):
    """A robot of which the disk knows nothing new."""
    floors = {KEY.fingerprint: floor, NEXT.fingerprint: 0}
    disk = Remembered(floors, {}, KEY.fingerprint)
    params = SecurityParams(mode="seal", **params)
    new = Sealing(own_id, SIZE, params, list(keys), disk, lambda n: bytes([own_id]) * n)
    new.look(0.0)
    return new


def robot(own_id=1, keys=(KEY,), floor=0, **params):
    new = made(own_id, keys, floor, **params)
    new.memory.written(new.memory.wanted(0.0))
    assert new.may_send(0.0, 0, 1), "its clock begins"
    return new


def pdu(seq, *records, src=1, dst=255):
    builder = PduBuilder(INNER)
    builder.add(*Entry(0, 77, 0, 1, b"abcd"))
    for record in records:
        assert builder.add_record(build_records([record]))
    return builder.build(0, src, dst, seq, 2)


def opened(one, two, at, seq, *records, later_s=0.01):
    return two.opener.open(one.seal(pdu(seq, *records), at), at + later_s)


def test_a_source_that_begins_anew_is_heard_at_once():
    one, two = robot(1), robot(2)
    opened(one, two, 1.0, 1, Contact(b"12345678"))
    assert opened(one, two, 2.0, 2, Contact(b"87654321"), later_s=0.5).inner[:-2] == pdu(
        2, Contact(b"87654321")
    )[:-2]  # fmt: skip
    assert opened(one, two, 3.0, 3, later_s=0.5).is_proven is False


@pytest.mark.parametrize("off", [0.0, 0.1, 0.12, -0.13, -0.15])
def test_a_source_that_repeats_our_number_is_proven_if_its_times_fit(off):
    one, two = robot(1), robot(2)
    assert not opened(one, two, 1.0, 1).is_proven
    met = Met(2, bytes([2]) * 4, round(64 * off))
    fits = abs(0.01625 + round(64 * off) / 64) <= 0.13
    assert opened(one, two, 1.1, 2, Contact(b"12345678", (met,))).is_proven == fits
    for other in (met._replace(number=bytes(4)), met._replace(node=3)):
        alone = robot(2)
        assert not opened(one, alone, 2.0 + other.node, 3, Contact(b"12345678", (other,))).is_proven


def test_a_source_that_begins_anew_proves_itself_anew():
    one, two = robot(1), robot(2)
    met = Met(2, bytes([2]) * 4, 0)
    assert opened(one, two, 1.0, 1, Contact(b"12345678", (met,))).is_proven
    assert opened(one, two, 1.1, 2, Contact(b"12345678")).is_proven
    assert not opened(one, two, 1.2, 3, Contact(b"87654321")).is_proven


@pytest.mark.parametrize("src", [1, 2])
def test_a_robot_that_has_the_next_key_says_so(src):
    one, two = robot(src), robot(9, (KEY, NEXT))
    told = KeyTold(1, False, NEXT.fingerprint[:4])
    assert two.further_key() == told
    opened_at = one.seal(pdu(1, told, src=src), 1.0)
    two.opener.open(opened_at, 1.01)
    two.look(1.0)
    assert two.report(1.0).kid == 1, "all who are here have it"


def test_what_is_not_sealed_well_is_left_to_others_to_refuse():
    two = robot(2)
    clear = pdu(1).ljust(SIZE)
    for data in (b"", b"short", clear, pdu(1)):
        assert not two.opener.refuses_clear(data, 0.0)
    assert two.notices(0.0) == []


def refusal(two, data, at):
    with pytest.raises(PduError) as refused:
        two.opener.open(data, at)
    return refused.value.reason


def test_of_a_robot_that_holds_our_key_now_nobody_is_told():
    two, other = robot(2), robot(1, (NEXT,))
    assert refusal(two, other.seal(pdu(1), 1.0), 1.0) == "sec_unknown_kid"
    (told,) = two.notices(1.0)
    assert "robot 1 is heard, but uses key 1, which is not installed here" in told
    opened(robot(1), two, 1.1, 2)
    assert two.notices(1.2) == []


def test_a_disk_that_has_failed_stops_us_once_its_numbers_are_used():
    one = robot(1)
    one.memory.not_written("No space left on device")
    assert one.may_send(59.0, 0, 1)
    assert not one.may_send(60.0, 0, 1)
    assert one.halted.endswith("cannot be written to disk: No space left on device")
    never = made(2)
    never.memory.not_written("No space left on device")
    assert not never.may_send(0.0, 0, 1), "nothing was ever written"
    assert never.halted.endswith("No space left on device")


def test_what_does_not_open_is_refused_by_name():
    one, two, later = robot(1), robot(2), robot(1, (NEXT,))
    data = one.seal(pdu(1), 1.0)
    two.opener.open(data, 1.0)
    assert refusal(two, data, 1.0) == "rx_dup"
    assert refusal(two, one.seal(pdu(2), 1.0)[:-1], 1.0) == "rx_short"
    assert refusal(two, later.seal(pdu(2), 1.0), 1.0) == "sec_unknown_kid"
    assert two.clear_due_at == 1.0
    unknown = "sec_unknown_kid"
    for seq, dst, reason in ((3, 255, unknown), (4, 2, unknown), (5, 3, "rx_not_for_us")):
        assert refusal(two, later.seal(pdu(seq, dst=dst), 1.5), 1.5) == reason
    assert refusal(two, delayed(one.seal(pdu(4), 2.0), 300_000), 2.0) == "sec_late"
    assert refusal(robot(1), one.seal(pdu(5), 2.0), 2.0) == "rx_own"
    for at in (5.0, 10.0):
        two.opener.open(one.seal(pdu(6), at), at)
    assert refusal(two, one.seal(pdu(7), 7.9), 10.0) == "sec_replay"


def test_the_ages_in_a_pdu_grow_by_the_time_for_which_it_was_held():
    one, two = robot(1), robot(2)
    two.opener.open(one.seal(pdu(1), 1.0), 1.01)
    held = delayed(one.seal(pdu(2, Stamp(0, 77, 5)), 1.1), 100_000)
    found = two.opener.open(held, 1.31, 0.1)
    assert found.held_s == pytest.approx(0.2)
    assert found.inner[:-2] == pdu(2, Stamp(0, 77, 200_005))[:-2]


def test_a_pdu_that_leaves_later_keeps_its_number_unless_its_content_depends_on_the_start():
    one = robot(1)
    clear = pdu(1, Stamp(0, 77, 5))
    assert one.later(clear, clear, 500, 2.0, int) == (postponed(clear, 500), clear)
    plain, timed = pdu(1, Stamp(0, 77, 5)), pdu(2, Frame(1, 0, 2, 3))
    for inner, kept in ((plain, plain), (timed, b"")):
        data = one.seal(inner, 1.0)
        assert one.later(data, kept, 500, 2.0, int) == (delayed(data, 500), kept)
    assert depends_on_start(timed)
    data = one.seal(pdu(3, Frame(1, 0, 2, 3)), 1.0)
    anew, inner = one.later(data, pdu(3, Frame(1, 0, 2, 3)), 500, 2.0, lambda: 9)
    assert inner == pdu(9, Frame(1, 0, 2, 503))
    told = parse_sealed(anew, SIZE)
    assert (told.seq, told.ticks, told.held) == (9, 64, 0)
    # Where no number is left, others see that it was delayed.
    again, same = one.later(anew, inner, 500, 2.0, lambda: 9)
    assert (again, same) == (delayed(anew, 500), inner)


@pytest.mark.parametrize(("days", "is_told"), [(30, False), (29, True)])
def test_a_month_before_the_end_of_a_key_a_person_is_told(days, is_told):
    one = robot(1, floor=N_TICKS - 32 * DAY_S * days - 960)
    notices = one.notices(0.0)
    assert any(f"can be used for {days} more days" in each for each in notices) == is_told
    assert one.report(0.0).key_days_left == days


def test_settings_that_let_others_in_are_told():
    for params, words in (
        ({"unproven": "deliver"}, 'security.unproven = "deliver"'),
        ({"clear": "accept"}, 'security.clear = "accept"'),
    ):
        (notice,) = robot(1, **params).notices(0.0)
        assert words in notice


def test_who_is_heard_and_not_proven_is_told_after_a_moment_for_as_long_as_it_is_heard():
    one, two = robot(1), robot(2)
    for at in range(1, 8):
        opened(one, two, float(at), at)
        notices = two.notices(at + 0.01)
        assert bool(notices) == (at > 6), at
    assert "robot 1 has our key and has not proven to be alive" in two.notices(16.9)[0]
    assert two.notices(17.01) == []
    assert two.report(67.0).not_proven == [1]
    assert two.report(67.01).not_proven == []
