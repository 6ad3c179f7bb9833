"""The rows on many robots that all hear each other."""

from collections.abc import Iterator, Sequence
from functools import partial

from benchmarks.report import Row
from benchmarks.team.crowd import Class, Waited, wait_beside
from benchmarks.team.runs import Run, Runs, results
from benchmarks.team.teams import Policy

OURS: Policy = "auction"
PEERS: tuple[Policy, ...] = ("minislot", "tdma", "grant")
URGENT_OVER: tuple[Class, ...] = ("bulk", "latency")
P99_MS, CARRIED_MBPS = {8: 8.5, 24: 10.5}, {8: 4.5, 24: 4.2}
CONTROL_PCT = {8: 3.0, 24: 5.0}
DEFAULT_MS = 9.5

Case = tuple[Policy, int, Class, Class, int, float]


def rows(runs: Runs, seed: int, quick: bool) -> Iterator[Row]:
    """Delays of a robot beside others that fill the air, and what all carry meanwhile."""
    lengths_s = {8: 1.0, 24: 0.5} if quick else {8: 20.0, 24: 6.0}
    peers = ("minislot",) if quick else PEERS
    cases: list[Case] = [
        (policy, n, others, "urgent", seed, length_s)
        for policy in (OURS, *peers)
        for n, length_s in lengths_s.items()
        for others in URGENT_OVER
    ]
    cases += [(policy, 8, "bulk", "default", seed, lengths_s[8]) for policy in (OURS, *peers)]
    under_way = {
        case: runs.add(
            f"crowd of {case[1]}, {case[0]}, {case[3]} over {case[2]}", case[1] * (case[5] + 3),
            partial(wait_beside, *case),
        )
        for case in cases
    }  # fmt: skip
    return _rows(under_way, lengths_s, peers, seed)


def _rows(
    under_way: dict[Case, Run[Waited]], lengths_s: dict[int, float], peers: Sequence[Policy],
    seed: int,
) -> Iterator[Row]:  # fmt: skip
    found = results(under_way)
    note = (
        "robots that all hear each other, and react within 1 ms: one sends 64 B, ten a second at "
        "random; the others offer 9 Mbit/s together on an air for 6"
    )
    for n, length_s in lengths_s.items():
        of: dict[Policy, list[Waited]] = {}
        for policy in (OURS, *peers):
            each = [found.get((policy, n, others, "urgent", seed, length_s))
                    for others in URGENT_OVER]  # fmt: skip
            of[policy] = [waited for waited in each if waited is not None]
        yield from _beside(n, of, note)
    default = {
        policy: waited
        for policy in (OURS, *peers)
        if (waited := found.get((policy, 8, "bulk", "default", seed, lengths_s[8])))
    }
    if OURS in default:
        ours = default.pop(OURS)
        yield Row(
            "default_over_bulk_max_ms_8", 1e3 * ours.longest_s, "ms", DEFAULT_MS, "less",
            ours.n, peers={policy: 1e3 * each.longest_s for policy, each in default.items()},
            note="one robot of eight sends 64 B of class default, the others bulk; the longest "
            "delay",
        )  # fmt: skip


def _beside(n: int, of: dict[Policy, list[Waited]], note: str) -> Iterator[Row]:
    """The rows of `n` robots, for those policies of which all runs went well."""
    peers = {policy: each for policy, each in of.items() if len(each) == len(URGENT_OVER)}
    ours = peers.pop(OURS, None)
    if ours is None:
        return
    trials = sum(each.n for each in ours)
    yield Row(
        f"urgent_p99_ms_{n}", _p99_ms(ours), "ms", P99_MS[n], "less", trials,
        peers={policy: _p99_ms(each) for policy, each in peers.items()},
        note=f"{note}; bulk or latency, whichever is worse; policy auction",
    )  # fmt: skip
    yield Row(
        f"carried_mbps_{n}", _mbps(ours), "Mbit/s", CARRIED_MBPS[n], "more", trials,
        peers={policy: _mbps(each) for policy, each in peers.items()},
        note="payload that came, in the runs of the row above; the worse one",
    )  # fmt: skip
    yield Row(
        f"control_airtime_pct_{n}", _control_pct(ours), "%", CONTROL_PCT[n], "less", trials,
        peers={policy: _control_pct(each) for policy, each in peers.items()},
        note=(
            "PDUs that hold only records, and pulses, in these runs; the worse one; records "
            "in PDUs with messages are not counted"
        ),
    )  # fmt: skip


def _p99_ms(runs: list[Waited]) -> float:
    return 1e3 * max(each.p99_s for each in runs)


def _control_pct(runs: list[Waited]) -> float:
    return 100 * max(each.control for each in runs)


def _mbps(runs: list[Waited]) -> float:
    return min(each.carried_mbps for each in runs)
