"""The rows on the worst case: whether the bound that the plan computes is ever broken."""

from collections.abc import Iterator
from functools import partial

from benchmarks.report import Row
from benchmarks.team.runs import Runs, results
from benchmarks.team.teams import Policy
from benchmarks.team.worst import Told, strain

OURS: Policy = "auction"
PEERS: tuple[Policy, ...] = ("minislot", "tdma", "grant")

Case = tuple[Policy, int, int, float]
Found = dict[Policy, list[Told]]


def rows(runs: Runs, seed: int, quick: bool) -> Iterator[Row]:
    """Urgent messages that waited longer than the plan says: an hour of 8, ten minutes of 24."""
    ours = {8: (1, 8.0), 24: (1, 3.0)} if quick else {8: (6, 600.0), 24: (4, 150.0)}
    others = {8: (1, 4.0), 24: (1, 2.5)} if quick else {8: (2, 150.0), 24: (1, 100.0)}
    cases: list[Case] = [
        (policy, n, seed + i, length_s)
        for policy in (OURS, *PEERS)
        for n, (count, length_s) in (ours if policy == OURS else others).items()
        for i in range(count)
    ]
    under_way = {
        case: runs.add(
            f"worst case, {case[0]}, {case[1]} robots, seed {case[2]}", case[1] * case[3],
            partial(strain, *case),
        )
        for case in cases
    }  # fmt: skip

    def found() -> Iterator[Row]:
        for n, (count, length_s) in ours.items():
            told = results({case: run for case, run in under_way.items() if case[1] == n})
            of: Found = {}
            for (policy, *_), each in told.items():
                of.setdefault(policy, []).append(each)
            if sum(case[0] == OURS for case in told) == count:
                yield from _rows(n, count, length_s, seed, of)

    return found()


def _rows(n: int, count: int, length_s: float, seed: int, of: Found) -> Iterator[Row]:
    peers = [each for each in PEERS if each in of]
    seeds = f"{count} runs of {length_s:g} s, seeds {seed} to {seed + count - 1},"
    yield Row(
        f"bound_broken_{n}", _sum(of[OURS], "broken"), "messages", 0, "less",
        _sum(of[OURS], "n"), peers={each: _sum(of[each], "broken") for each in peers},
        note=(
            f"urgent messages that waited longer than `sdrlinkctl plan` says, in "
            f"{seeds if count > 1 else f'{length_s:g} s'} of policy auction, without announced "
            "outages; all robots saturate the air with less urgent classes, move, leave and come "
            "back; 5 % of PDUs are lost"
        ),
    )  # fmt: skip
    yield Row(
        f"longest_wait_over_bound_{n}", _over(of[OURS]), "ratio", 1.0, "less",
        _sum(of[OURS], "n"),
        peers={each: _over(of[each]) for each in peers}
        | {f"bound_{each}_ms": 1e3 * of[each][0].bound_s for each in of},
        note="the longest wait of an urgent message, over the bound, in the runs above",
    )  # fmt: skip
    yield Row(
        f"urgent_in_outages_pct_{n}", _pct(of[OURS], "in_outages"), "%", None, "less",
        _sum(of[OURS], "n"), peers={each: _pct(of[each], "in_outages") for each in peers},
        note="urgent messages that waited while their robot lacked what tells its turns",
    )  # fmt: skip
    yield Row(
        f"urgent_lost_pct_{n}", _pct(of[OURS], "lost"), "%", None, "less",
        _sum(of[OURS], "n"),
        peers={each: _pct(of[each], "lost") for each in peers}
        | {"repeated_ms": 1e3 * max(each.repeated_s for each in of[OURS])},
        note=(
            "urgent messages that never came to another robot that was there; repeated_ms: "
            "the longest time from when one left until it came, repeated"
        ),
    )  # fmt: skip


def _sum(runs: list[Told], what: str) -> int:
    return sum(getattr(each, what) for each in runs)


def _pct(runs: list[Told], what: str) -> float:
    return 100 * _sum(runs, what) / max(1, _sum(runs, "n"))


def _over(runs: list[Told]) -> float:
    return max(each.longest_s / each.bound_s for each in runs)
