"""Other ways to bring messages over an air that loses some, on the same losses and airtimes.

Both are models of single packets: a packet holds one message, and nothing else loses time.
"""

from heapq import heappop, heappush
from random import Random

from benchmarks.repeats.losses import Losses
from benchmarks.repeats.ours import PDU_S, PREAMBLE_S, START_S, TURN_S, Outcomes, Traffic

PACKET_S = PREAMBLE_S + PDU_S + TURN_S
"""Time on the air of a packet."""
WAIT_S, AGAIN_S = 0.05, 0.2
"""Times in s of the examples of OpenPGM: random wait before a NAK (NAK_BO_IVL, at most), and time
until it is repeated (NAK_RPT_IVL)."""
TRIES = 50
HEARTBEAT_S = 0.1
"""Time in s after the last packet until the source tells its last number (SPM)."""


def block_code(traffic: Traffic, losses: Losses, k: int, n: int) -> Outcomes:
    """Blocks of `k` messages and `n` - k packets of a code, any k of which restore all (wfb-ng).

    What arrives is delivered at once, as this is about latency; wfb-ng keeps the order.
    """
    outcomes = Outcomes(traffic.n, air_share=PACKET_S / traffic.period_s * n / k)
    free_at = 0.0
    for first in range(0, traffic.n, k):
        numbers = range(first, min(first + k, traffic.n))
        came, got = 0, dict[int, float]()
        for i in range(len(numbers) + n - k):
            due_at = START_S + numbers[min(i, len(numbers) - 1)] * traffic.period_s
            at = max(due_at, free_at)
            free_at = at + PACKET_S
            if losses(at + PACKET_S / 2):
                continue
            came += 1
            if i < len(numbers):
                got[numbers[i]] = at + PACKET_S
            if came == len(numbers):
                for number in numbers:
                    got.setdefault(number, at + PACKET_S)
        for number, at in got.items():
            outcomes.took_s[number] = at - START_S - number * traffic.period_s
    return outcomes


def nak_repeat(traffic: Traffic, losses: Losses, seed: int) -> Outcomes:
    """Negative acknowledgments as in RFC 3208: a gap starts a random wait, then the NAK.

    The source confirms it (NCF) and sends the packet again (RDATA). A NAK without confirmation is
    repeated. All packets share the air.
    """
    rng = Random(seed)
    outcomes = Outcomes(traffic.n)
    events: list[tuple[float, int, str, int]] = []
    serial, newest, sent_packets = 0, -1, 0
    missing: dict[int, int] = {}

    def put(at: float, what: str, number: int) -> None:
        nonlocal serial
        serial += 1
        heappush(events, (at, serial, what, number))

    for number in range(traffic.n):
        put(START_S + number * traffic.period_s, "data", number)
    put(START_S + traffic.n * traffic.period_s + HEARTBEAT_S, "heartbeat", traffic.n - 1)
    free_at = 0.0
    while events:
        due_at, _, what, number = heappop(events)
        if what == "nak" and (number not in missing or missing[number] >= TRIES):
            continue
        at = max(due_at, free_at)
        if at > due_at:
            # The air is taken; whoever is first then, sends.
            put(at, what, number)
            continue
        free_at = at + PACKET_S
        arrives = not losses(at + PACKET_S / 2)
        if what == "nak":
            missing[number] += 1
            put(free_at + AGAIN_S, "nak", number)
            if arrives:
                put(free_at, "confirm", number)
                put(free_at, "repeat", number)
            continue
        sent_packets += 1
        if not arrives or what == "confirm":
            continue
        if what in ("data", "repeat") and number not in outcomes.took_s:
            due = START_S + number * traffic.period_s
            outcomes.took_s[number] = free_at - due
            missing.pop(number, None)
        for each in range(newest + 1, number + (what == "heartbeat")):
            missing[each] = 0
            put(free_at + rng.uniform(0, WAIT_S), "nak", each)
        newest = max(newest, number)
    outcomes.air_share = sent_packets * PACKET_S / (traffic.n * traffic.period_s)
    return outcomes
