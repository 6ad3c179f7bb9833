"""Three gateways that elect a leader for one robot, tick by tick, and the faults of a tick."""

from copy import copy

from sdrlinkd.fleet import TERMS, Claim

LEASE_S = 1.0
TICK_S = 0.1
SCORES = {7: 0.8, 8: 0.97, 9: 0.5}
FORGERS_GW = 200
FORGED = (
    (FORGERS_GW, 1, 2.0), (FORGERS_GW, TERMS // 2, 2.0), (FORGERS_GW, TERMS // 2 - 1, -1.0),
    (FORGERS_GW, TERMS // 2 + 1, 2.0), (7, 1, 2.0), (8, 1, -1.0), (8, TERMS // 2 - 1, 2.0),
)  # fmt: skip
"""What may be forged: (gateway, term after that of the gateway that hears it, score).

A term is ahead by one, by as much as there is, or by more: then it is behind.
"""


def term_of(election):
    """The latest term that a gateway knows; None: none."""
    return vars(election)["_term"]


def ticked(elections, now, order, lost=()):
    """The gateways after one tick: each polls, and the others hear it but for what is lost."""
    after = {gw: copy(each) for gw, each in elections.items()}
    for gw in order:
        after[gw].hear(SCORES[gw], now)
        claim = after[gw].poll(now)
        for other in after:
            if claim is not None and other != gw and (gw, other) not in lost:
                after[other].claimed(claim, now)
    return after


def faulty(elections, now, order):
    """(faults, the gateways after a tick with them): a claim is lost, or one is forged."""
    yield 0, ticked(elections, now, order)
    ways = [(a, b) for a in order for b in order if a != b]
    for way in ways:
        yield 1, ticked(elections, now, order, (way,))
    for gw, more, its_score in FORGED:
        for heard_by in (*([each] for each in order), order):
            hit = {each: copy(election) for each, election in elections.items()}
            for each in heard_by:
                term = ((term_of(hit[each]) or 0) + more) % TERMS
                hit[each].claimed(Claim(gw, term, its_score), now)
            yield 1, ticked(hit, now, order)


def heals(elections, now):
    """Whether, from now on without faults, one gateway leads within a lease, and goes on."""
    leaders = []
    for tick in range(30):
        elections = ticked(elections, now + tick * TICK_S, list(SCORES))
        leaders.append(tuple(gw for gw, each in elections.items() if each.leads))
    # The lease, the wait before a claim, and a tick.
    settled = leaders[round((LEASE_S + 0.2) / TICK_S) :]
    agreed = {each.leader for each in elections.values()}
    return {len(each) for each in settled} == {1} and len(agreed) == 1
