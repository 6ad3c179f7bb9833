"""The stored corpus, and a first few thousand changes of it, crash nothing."""

import zlib
from random import Random

import pytest

from tests.fuzz.corpus import CORPUS, inputs
from tests.fuzz.mutate import mutate
from tests.fuzz.targets import TARGETS
from tests.laws import trials

CHANGES = 1500


def stored(name):
    return [path.read_bytes() for path in sorted((CORPUS / name).iterdir())]


def test_each_target_has_a_corpus():
    assert {each.name for each in CORPUS.iterdir()} == set(TARGETS)
    assert set(inputs()) == set(TARGETS)


@pytest.mark.parametrize("name", TARGETS)
def test_nothing_crashes(name):
    seeds = stored(name)
    for data in (b"", *seeds):
        TARGETS[name](data)
    chance = Random(zlib.crc32(name.encode()))
    n = trials(CHANGES if name not in ("config", "sigmf") else CHANGES // 10)
    for _ in range(n):
        data = chance.choice(seeds)
        for _ in range(chance.randrange(1, 4)):
            data = mutate(name, data, chance)
        TARGETS[name](data)


def test_a_reader_that_fails_is_found():
    """The search can fail."""

    def search():
        chance, data = Random(1), stored("records")[0]
        for _ in range(3000):
            if b"\x0a" in mutate("records", data, chance):
                raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        search()
