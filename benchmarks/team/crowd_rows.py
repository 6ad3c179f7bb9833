"""The rows on many robots that all hear each other."""

from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor

from benchmarks.report import Row
from benchmarks.team.crowd import Class, Waited, wait_beside
from benchmarks.team.teams import Policy

OURS: Policy = "auction"
PEERS: tuple[Policy, ...] = ("minislot", "tdma", "grant")
URGENT_OVER: tuple[Class, ...] = ("bulk", "latency")
P99_MS, CARRIED_MBPS = {8: 8.5, 24: 10.5}, {8: 4.5, 24: 4.2}
CONTROL_PCT = {8: 3.0, 24: 5.0}
DEFAULT_MS = 9.5

Case = tuple[Policy, int, Class, Class, int, float]


def rows(seed: int, quick: bool) -> Iterator[Row]:
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
    with ProcessPoolExecutor() as pool:
        # The longest ones first.
        by_length = sorted(cases, key=lambda case: -case[1])
        found = dict(zip(by_length, pool.map(_run, by_length), strict=True))
    note = (
        "robots that all hear each other, and react within 1 ms: one sends 64 B, ten a second at "
        "random; the others offer 9 Mbit/s together on an air for 6"
    )
    for n, length_s in lengths_s.items():
        of = {
            policy: [found[policy, n, others, "urgent", seed, length_s] for others in URGENT_OVER]
            for policy in (OURS, *peers)
        }
        trials = sum(each.n for each in of[OURS])
        yield Row(
            f"urgent_p99_ms_{n}", _p99_ms(of[OURS]), "ms", P99_MS[n], "less", trials,
            peers={policy: _p99_ms(of[policy]) for policy in peers},
            note=f"{note}; bulk or latency, whichever is worse; policy auction",
        )  # fmt: skip
        yield Row(
            f"carried_mbps_{n}", _mbps(of[OURS]), "Mbit/s", CARRIED_MBPS[n], "more", trials,
            peers={policy: _mbps(of[policy]) for policy in peers},
            note="payload that came, in the runs of the row above; the worse one",
        )  # fmt: skip
        yield Row(
            f"control_airtime_pct_{n}", _control_pct(of[OURS]), "%", CONTROL_PCT[n], "less",
            sum(each.n for each in of[OURS]),
            peers={policy: _control_pct(of[policy]) for policy in peers},
            note=(
                "PDUs that hold only records, and pulses, in these runs; the worse one; records "
                "in PDUs with messages are not counted"
            ),
        )  # fmt: skip
    default = {policy: found[policy, 8, "bulk", "default", seed, lengths_s[8]]
               for policy in (OURS, *peers)}  # fmt: skip
    yield Row(
        "default_over_bulk_max_ms_8", 1e3 * default[OURS].longest_s, "ms", DEFAULT_MS, "less",
        default[OURS].n, peers={policy: 1e3 * default[policy].longest_s for policy in peers},
        note="one robot of eight sends 64 B of class default, the others bulk; the longest delay",
    )  # fmt: skip


def _run(case: Case) -> Waited:
    return wait_beside(*case)


def _p99_ms(runs: list[Waited]) -> float:
    return 1e3 * max(each.p99_s for each in runs)


def _control_pct(runs: list[Waited]) -> float:
    return 100 * max(each.control for each in runs)


def _mbps(runs: list[Waited]) -> float:
    return min(each.carried_mbps for each in runs)
