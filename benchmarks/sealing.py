"""What sealing costs: processor time a PDU, latency a message, and octets a PDU."""

import statistics
import sys
import time
from collections.abc import Callable, Iterator
from random import Random

from cryptography.hazmat.primitives.ciphers.aead import AESCCM

from benchmarks.report import Row, main
from sdrlinkd.link import (
    AccessParams,
    Link,
    LinkParams,
    Opportunity,
    Outcome,
    PduLinkTraits,
    QueueParams,
    RateParams,
    ReassemblyParams,
)
from sdrlinkd.sealing import Key, Remembered, Sealing, SecurityParams
from sdrlinkd.wire import (
    CONTROL_TOPIC_ID,
    SEAL_OVERHEAD,
    Entry,
    Pdu,
    build,
    build_records,
    equal_payload,
    make_registry,
)

SIZES = (64, 256, 1024)
TAG_SIZE = 8
KEY = Key(0, bytes(range(32)))
NEW = Remembered({KEY.fingerprint: 0})
"""What is on disk of a key that was never used."""
A_TICK = 1 / 32
PDUS_PER_TICK = 200
PDUS_PER_S = 1000
US = 1e6


def measure(seed: int, quick: bool) -> Iterator[Row]:
    """Measure all rows; `quick` takes about a tenth of the trials."""
    rounds, n = (5, 2000) if quick else (15, 10_000)
    costs = {size: _cost(size, n, rounds, seed) for size in SIZES}
    for size, (ours_us, bare_us) in costs.items():
        yield Row(
            f"seal_and_open_over_bare_{size}B", ours_us / bare_us, "ratio", 4.0, "less", rounds,
            peers={"seal_and_open_us": ours_us, "cryptography_us": bare_us},
            note="CPU time beside AES-CCM of the cryptography package, encrypt and decrypt",
        )  # fmt: skip
    yield Row(
        "core_pct_at_1000_pdus_per_s_each_way",
        100 * PDUS_PER_S * costs[1024][0] / US, "%", 2.5, "less", rounds,
        note="sealing and opening 1024 B PDUs",
    )  # fmt: skip
    clear, sealed = (_message_us(is_sealed, rounds, n // 10, seed) for is_sealed in (False, True))
    yield Row(
        "latency_added_us", sealed - clear, "µs", 50.0, "less", rounds,
        peers={"in_the_clear_us": clear, "sealed_us": sealed},
        note="CPU time of one message of 40 B through both links",
    )  # fmt: skip
    for size in (64, 1024):
        kept = equal_payload(size - SEAL_OVERHEAD, 1) / equal_payload(size, 1)
        yield Row(
            f"goodput_kept_{size}B_pct", 100 * kept, "%", None, "more", 1,
            peers={
                "payload_octets": equal_payload(size - SEAL_OVERHEAD, 1),
                "in_the_clear": equal_payload(size, 1),
            },
            note="payload of a PDU with one entry, beside that in the clear", exact=True,
        )  # fmt: skip
    yield Row(
        "overhead_octets", SEAL_OVERHEAD, "B", 25.0, "less", 1,
        peers={"wfb-ng": 25, "Reticulum": 48},
        note="octets that a PDU loses; peers by their formats", exact=True,
    )  # fmt: skip


def _cost(size: int, n: int, rounds: int, seed: int) -> tuple[float, float]:
    """(seal and open, bare encrypt and decrypt) of a PDU in µs of CPU time; medians.

    The first run, in which caches fill, does not count.
    """
    chance = Random(seed)
    ours, bare = [], []
    _ours(size, n, chance)
    for _ in range(rounds):
        ours.append(_ours(size, n, chance))
        bare.append(_bare(size, n, chance))
    return statistics.median(ours), statistics.median(bare)


def _ours(size: int, n: int, chance: Random) -> float:
    sender, receiver = _sealing(1, size), _sealing(2, size)
    inner = [_inner(size, seq & 0xFF, chance) for seq in range(n)]
    # At most 256 PDUs have one T, so time goes on.
    starts = [A_TICK * (1 + seq // PDUS_PER_TICK) for seq in range(n)]
    for start in starts:
        _remember(sender, start)
    _introduce(sender, receiver)
    pairs = list(zip(inner, starts, strict=True))

    def work() -> None:
        for pdu, start in pairs:
            receiver.opener.open(sender.seal(pdu, start), start)

    return _cpu_us(work, n)


def _introduce(*both: Sealing) -> None:
    """Let both prove that they are alive, as each hears the other's CONTACT twice."""
    for number in range(4):
        one, other = both[number % 2], both[1 - number % 2]
        contact, _ = one.contact(0.0, 200)
        entry = Entry(CONTROL_TOPIC_ID, 0, 0, 1, build_records([contact]))
        src = 1 + number % 2
        inner = build(Pdu(0, False, src, 255, 250 + number, 1, [entry]), one.inner_size)
        other.opener.open(one.seal(inner, 0.0), 0.0)


def _bare(size: int, n: int, chance: Random) -> float:
    cipher = AESCCM(bytes(16), tag_length=TAG_SIZE)
    body, associated = chance.randbytes(size - 21), bytes(11)
    nonces = [number.to_bytes(13, "big") for number in range(n)]

    def work() -> None:
        for nonce in nonces:
            cipher.decrypt(nonce, cipher.encrypt(nonce, body, associated), associated)

    return _cpu_us(work, n)


def _cpu_us(work: Callable[[], None], n: int) -> float:
    begin = time.process_time()
    work()
    return US * (time.process_time() - begin) / n


def _inner(size: int, seq: int, chance: Random) -> bytes:
    inner = size - SEAL_OVERHEAD
    entry = Entry(1, seq, 0, 1, chance.randbytes(equal_payload(inner, 1)))
    return build(Pdu(0, False, 1, 255, seq, 1, [entry]), inner)


def _sealing(own_id: int, size: int) -> Sealing:
    made = Sealing(own_id, size, SecurityParams(mode="seal"), [KEY], NEW, _draw)
    _remember(made, 0.0)
    return made


def _draw(n: int) -> bytes:
    return bytes(n)


def _remember(sealing: Sealing, now: float) -> None:
    wanted = sealing.memory.wanted(now)
    if wanted is not None:
        sealing.memory.written(wanted)


def _message_us(is_sealed: bool, rounds: int, n: int, seed: int) -> float:
    return statistics.median(_messages(is_sealed, n, seed) for _ in range(rounds))


def _messages(is_sealed: bool, n: int, seed: int) -> float:
    """CPU time of a message, from submission to delivery at the other robot, in µs."""
    one, two = (_link(each, is_sealed, seed) for each in (1, 2))
    now, heard = 0.0, 0
    for _ in range(20):
        # Both robots learn that the other is alive.
        now += 0.1
        for here, there in ((one, two), (two, one)):
            _tick(here, now)
            _carry(here, there, now)
    begin = time.process_time()
    for _ in range(n):
        now += 0.002
        one.submit(0, bytes(40), now)
        heard += _carry(one, two, now)
    took_us = US * (time.process_time() - begin) / n
    if heard != n:
        raise RuntimeError(f"{heard} of {n} messages were delivered")
    return took_us


def _link(own_id: int, is_sealed: bool, seed: int) -> Link:
    sealing = _sealing(own_id, SIZES[1]) if is_sealed else None
    link = Link(
        LinkParams(pdu_size=SIZES[1], beacon_s=0.0), QueueParams(), ReassemblyParams(),
        make_registry([("odom", "nav_msgs/Odometry")]), own_id, Random(seed), sealing=sealing,
    )  # fmt: skip
    link.attach(PduLinkTraits(shares_air=True), AccessParams(), RateParams())
    return link


def _tick(link: Link, now: float) -> None:
    if isinstance(link.sealing, Sealing):
        _remember(link.sealing, now)
    link.handle_timers(now)


def _carry(source: Link, sink: Link, now: float) -> int:
    burst = source.next_burst(Opportunity(now, lambda _, n: n * 1e-4, lambda *_: 8))
    if burst is None:
        return 0
    source.confirm(burst, Outcome.SENT, now)
    return sum(len(sink.hear(pdu, now)) for pdu in burst.pdus)


if __name__ == "__main__":
    sys.exit(main("sealing", measure))
