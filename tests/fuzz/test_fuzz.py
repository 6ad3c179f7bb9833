"""The stored corpus, and a first few thousand changes of it, crash nothing."""

import zlib
from random import Random

import pytest

from sdrlinkd.errors import PduError
from sdrlinkd.wire import Repeat, parse, read_control_entries
from tests.fuzz.corpus import CORPUS, inputs
from tests.fuzz.mutate import mutate
from tests.fuzz.targets import PDU_SIZE, TARGETS
from tests.laws import FACTOR, trials

CHANGES = 1500


def stored(name):
    return [path.read_bytes() for path in sorted((CORPUS / name).iterdir())]


def test_each_target_has_a_corpus():
    assert {each.name for each in CORPUS.iterdir()} == set(TARGETS)
    assert set(inputs()) == set(TARGETS)


def search(name, target, changes=CHANGES):
    """Give a target its stored corpus, and changes of it."""
    seeds = stored(name)
    for data in (b"", *seeds):
        target(data)
    chance = Random(zlib.crc32(name.encode()))
    n = trials(changes if name not in ("config", "sigmf") else changes // 10)
    for _ in range(n):
        data = chance.choice(seeds)
        for _ in range(chance.randrange(1, 4)):
            data = mutate(name, data, chance)
        target(data)


@pytest.mark.parametrize("name", TARGETS)
def test_nothing_crashes(name):
    search(name, TARGETS[name])


def test_a_fault_behind_checksum_and_length_is_found():
    def faulty(data):
        for at in range(0, len(data), PDU_SIZE):
            try:
                control = read_control_entries(parse(data[at : at + PDU_SIZE], PDU_SIZE))
            except PduError:
                continue
            if any(isinstance(record, Repeat) for record in control.records):
                raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        # One change in about 500 makes such a record, of more than twenty kinds.
        search("link", faulty, round(3 * CHANGES / min(1.0, FACTOR)))
