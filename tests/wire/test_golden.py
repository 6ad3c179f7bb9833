"""The golden vectors, encoded and decoded."""

import binascii
from zlib import crc32

import pytest

from sdrlinkd.errors import PduError
from sdrlinkd.wire import (
    Beacon,
    Clock,
    ControlEntries,
    Entry,
    Frame,
    LinkReport,
    Need,
    Pdu,
    Receipt,
    RegistryDigest,
    Repeat,
    Stamp,
    TopicPiece,
    Waits,
    Wanted,
    build,
    build_records,
    identity,
    parse,
    parse_records,
    parse_registry,
    read_control_entries,
)
from tests.wire.vectors import (
    BY_NAME,
    CRC_CHECK,
    DIGESTS,
    DOCUMENTED,
    PDUS,
    RECORDS,
    REFUSALS,
    DigestVector,
    PduVector,
    RecordsVector,
    RefusalVector,
    crc16_xmodem,
)

RECORD_CLASSES = {
    "STAMP": Stamp,
    "BEACON": Beacon,
    "DIGEST": RegistryDigest,
    "LINK_REPORT": LinkReport,
    "RECEIPT": Receipt,
    "FRAME": Frame,
    "CLOCK": Clock,
    "WAITS": Waits,
    "TOPIC": TopicPiece,
    "WANTED": Wanted,
    "NEED": Need,
    "REPEAT": Repeat,
}

each_pdu = pytest.mark.parametrize("vector", PDUS, ids=lambda v: v.name)
each_payload = pytest.mark.parametrize("vector", RECORDS, ids=lambda v: v.name)
each_digest = pytest.mark.parametrize("vector", DIGESTS, ids=lambda v: v.name)


def pdu_of(vector: PduVector) -> Pdu:
    entries = [Entry(*fields) for fields in vector.entries]
    return Pdu(vector.qos, False, vector.src, vector.dst, vector.seq, vector.hop, entries)


def records_of(vector: RecordsVector) -> list[object]:
    return [RECORD_CLASSES[name](*fields) for name, fields in vector.records]


def test_crc_check_value():
    octets, crc = CRC_CHECK
    assert crc16_xmodem(octets) == crc == 0x31C3
    assert binascii.crc_hqx(octets, 0) == crc


@each_pdu
def test_build(vector):
    assert build(pdu_of(vector), vector.pdu_size).hex(" ") == vector.octets.hex(" ")


@each_pdu
def test_parse(vector):
    assert parse(vector.octets, vector.pdu_size) == pdu_of(vector)


@each_pdu
def test_identity(vector):
    without_hop = bytearray(vector.octets[:-2])
    without_hop[4] &= 0x0F
    assert identity(vector.octets) == (vector.src, vector.seq, crc32(without_hop))


@pytest.mark.parametrize("name", DOCUMENTED)
def test_vectors_of_the_document(name):
    assert DOCUMENTED[name] == BY_NAME[name].octets.hex(" ")


@pytest.mark.parametrize("vector", REFUSALS, ids=lambda v: v.name)
def test_refusal(vector: RefusalVector):
    with pytest.raises(PduError) as refused:
        parse(vector.octets, vector.pdu_size)
    assert refused.value.reason == vector.reason


@each_payload
def test_build_records(vector):
    assert build_records(records_of(vector)) == vector.payload


@each_payload
def test_parse_records(vector):
    assert parse_records(vector.payload) == records_of(vector)


def test_an_entry_that_cannot_be_read_is_skipped_and_no_other():
    vector = BY_NAME["message_and_spoilt_control"]
    told = read_control_entries(parse(vector.octets, vector.pdu_size))
    assert told == ControlEntries([Receipt(3, 0x99, 1)], n_entries=2, n_bad=1)


@each_digest
def test_registry_digest(vector: DigestVector):
    digest = parse_registry(vector.csv).digest()
    assert digest.overall.hex() == vector.digest.hex()
    assert digest.per_topic.hex() == vector.per_topic.hex()
