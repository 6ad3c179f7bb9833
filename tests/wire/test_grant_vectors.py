"""WANT, GRANT and the turns that they tell, against values that were worked out by hand."""

from struct import pack

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sdrlinkd.link.access import Ticks
from sdrlinkd.wire import (
    AGE_UNIT_S,
    AIR_UNIT_S,
    MAX_AGE,
    MAX_AIR,
    Frame,
    Grant,
    Want,
    build_records,
    code_of,
    crc16,
    parse_records,
)
from tests.laws import law
from tests.wire.grant_vectors import AGE_CODES, AIR_CODES, GRANT_RECORDS, SCHEDULE, TURNS

KINDS = {"WANT": Want, "GRANT": Grant, "FRAME": Frame}


@pytest.mark.parametrize("vector", GRANT_RECORDS, ids=lambda vector: vector.name)
def test_records(vector):
    records = [KINDS[kind](*fields) for kind, fields in vector.records]
    assert parse_records(vector.payload) == records
    assert build_records(records) == vector.payload


def test_an_odd_octet_is_ignored():
    payload = build_records([Grant(1, 2, 3, ((4, 5),))]) + b"\7"
    assert parse_records(bytes([12, payload[1] + 1]) + payload[2:]) == [Grant(1, 2, 3, ((4, 5),))]


@pytest.mark.parametrize(("time_s", "code"), AIR_CODES)
def test_codes_of_airtimes(time_s, code):
    assert code_of(time_s, AIR_UNIT_S, MAX_AIR) == code


@pytest.mark.parametrize(("time_s", "code"), AGE_CODES)
def test_codes_of_ages(time_s, code):
    assert code_of(time_s, AGE_UNIT_S, MAX_AGE) == code


@law()
@given(st.floats(1e-6, 1e5))
def test_nothing_needs_more_than_was_told(air_s):
    told = Want(1, 0, 0, 0, code_of(air_s, AIR_UNIT_S, MAX_AIR), 0).air_s
    assert air_s <= told * (1 + 1e-9)
    assert told <= max(AIR_UNIT_S, air_s * 2 ** (1 / 8) * (1 + 1e-9))


@pytest.mark.parametrize(("tick_us", "guard_us", "begin_us", "told", "expected"), TURNS)
def test_turns(tick_us, guard_us, begin_us, told, expected):
    made = Ticks(1e-6 * tick_us, 1e-6 * guard_us).round(7, 1e-6 * begin_us, told)
    turns = [(node, round(1e6 * begin), round(1e6 * end)) for node, begin, end in made.turns]
    assert (turns, round(1e6 * made.end)) == expected


def test_schedule():
    *times, robots, schedule = SCHEDULE
    assert crc16(pack(">BIIII", 12, *times) + bytes(robots)) == schedule
