"""Names of messages: robots that hear the same message name it alike, and no two messages."""

from random import Random

import pytest

from sdrlinkd.client import MessageName
from sdrlinkd.link import ClassesParams, DefaultParams, Overrides, Qos
from tests.laws import often
from tests.link.lossy import Air

WINDOW_S = 2.0
SIZES = (0, 40, 200, 900, 3000)
LARGE_SIZE = 40_000


class Named(Air):
    """Robots that lose PDUs by chance, and note the names under which messages arrive."""

    def __init__(self, seed, loss, **params):
        self._rng, self._loss = Random(seed), loss
        self.missed = {2: set(), 3: set()}
        """Numbers of the PDUs on the air that were lost, by robot."""
        super().__init__(
            robots=(1, 2, 3), lost=self._misses, share=0.3, has_numbers=True,
            classes=ClassesParams(default=DefaultParams(parity=0.5)), **params,
        )  # fmt: skip
        self.named = {2: [], 3: []}
        """(name, number of the message, time) by robot."""

    def _misses(self, to, src, n, pdu):
        is_lost = to != 1 and self._rng.random() < self._loss
        if is_lost and src == 1:
            self.missed[to].add(n)
        return is_lost

    def take(self, robot, message):
        super().take(robot, message)
        number = int.from_bytes(message.payload[4:8], "little")
        self.named[robot].append((MessageName(*message.name), number, self.now))

    def check(self):
        """Every two receptions match if they are of one message, and only then."""
        for a, number_a, at_a in self.named[2]:
            for robot in (2, 3):
                for b, number_b, at_b in self.named[robot]:
                    if abs(at_a - at_b) < WINDOW_S:
                        assert a.matches(b) == b.matches(a) == (number_a == number_b), (a, b)


@pytest.mark.slow
def test_two_hearers_that_lose_different_pdus_name_messages_alike():
    both = 0
    for seed in range(often(3)):
        air = Named(seed, 0.25)
        rng = Random(100 + seed)
        for number in range(120):
            air.submit(1, number, rng.choice(SIZES), Overrides(rng.choice(list(Qos))))
            air.run(air.now + rng.uniform(0, 0.1))
        air.submit(1, 120, LARGE_SIZE)
        air.run(air.now + 1.0)
        air.check()
        got = [{number for _, number, _ in named} for named in air.named.values()]
        both += len(got[0] & got[1])
        assert min(len(air.missed[2] - air.missed[3]), len(air.missed[3] - air.missed[2])) > 50
        parted = [a for a, *_ in air.named[2] if a.more_pdus]
        assert parted
    assert both > 80 * often(3)


@pytest.mark.slow
def test_after_a_restart_of_the_source_its_messages_have_other_names():
    air = Named(7, 0.1)
    for number in range(60):
        air.submit(1, number)
        air.run(air.now + 0.03)
    air.restart(1, seed=50)
    for number in range(60, 120):
        air.submit(1, number)
        air.run(air.now + 0.03)
    air.check()
    boots = {name.boot_id for name, *_ in air.named[2]}
    assert len(boots - {None}) == 2


def test_names_of_a_pdu_whose_number_was_told_to_one_side_only():
    told = MessageName(7, 3, 0x1_05, 2)
    assert told.matches(MessageName(None, 3, 0x07, 0, is_numbered=False))
    assert not told.matches(MessageName(None, 3, 0x08, 0, is_numbered=False))
    assert not told.matches(MessageName(8, 3, 0x1_05, 2))
    assert not told.matches(MessageName(7, 3, 0x2_05, 2))
    assert MessageName(7, 3, 0xFFFF_FFFF, 1).matches(MessageName(7, 3, 0, 0))
