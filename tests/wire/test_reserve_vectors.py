"""FLOWS and ADMIT, against octets that were written out by hand."""

import pytest

from sdrlinkd.wire import Admit, Flows, ReservedFlow, build_records, parse_records
from tests.wire.reserve_vectors import FLOWS, RESERVE_RECORDS


def made(kind, fields):
    if kind == "ADMIT":
        return Admit(*fields)
    node, number, flows = fields
    return Flows(node, number, tuple(ReservedFlow(*each) for each in flows))


@pytest.mark.parametrize("vector", RESERVE_RECORDS, ids=lambda vector: vector.name)
def test_records(vector):
    records = [made(kind, fields) for kind, fields in vector.records]
    assert parse_records(vector.payload) == records
    assert build_records(records) == vector.payload


@pytest.mark.parametrize("more", [1, 13])
def test_octets_after_the_last_whole_flow_are_ignored(more):
    payload = bytes([22, 31 + more]) + FLOWS.payload[2:] + bytes(more)
    assert parse_records(payload) == [made(*FLOWS.records[0])]


def test_bits_without_a_meaning_are_ignored():
    """The upper seven of class and priority."""
    payload = bytearray(FLOWS.payload)
    payload[7] |= 0xFE
    assert parse_records(bytes(payload)) == [made(*FLOWS.records[0])]


def test_more_topics_are_admitted_than_there_are():
    assert parse_records(bytes([23, 6, 1, 0, 7, 3, 9, 4])) == [Admit(1, 7, 3, b"\4", b"")]
