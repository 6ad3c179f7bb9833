"""The rows on the worst case: whether the bound that the plan computes is ever broken."""

from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor

from benchmarks.report import Row
from benchmarks.team.teams import Policy
from benchmarks.team.worst import Told, strain

OURS: Policy = "auction"
PEERS: tuple[Policy, ...] = ("minislot", "tdma", "grant")

Case = tuple[Policy, int, int, float]


def rows(seed: int, quick: bool) -> Iterator[Row]:
    """Urgent messages that waited longer than the plan says: an hour of 8, ten minutes of 24."""
    ours = {8: (1, 8.0), 24: (1, 3.0)} if quick else {8: (6, 600.0), 24: (4, 150.0)}
    others = {8: (1, 4.0), 24: (1, 2.5)} if quick else {8: (2, 150.0), 24: (1, 100.0)}
    cases: list[Case] = [
        (policy, n, seed + i, length_s)
        for policy in (OURS, *PEERS)
        for n, (runs, length_s) in (ours if policy == OURS else others).items()
        for i in range(runs)
    ]
    with ProcessPoolExecutor() as pool:
        # The longest ones first.
        by_length = sorted(cases, key=lambda case: -case[1] * case[3])
        found = dict(zip(by_length, pool.map(_run, by_length), strict=True))
    for n in ours:
        of = {
            policy: [told for case, told in found.items() if case[:2] == (policy, n)]
            for policy in (OURS, *PEERS)
        }
        length_s = sum(case[3] for case in cases if case[:2] == (OURS, n))
        yield Row(
            f"bound_broken_{n}", _sum(of[OURS], "broken"), "messages", 0, "less",
            _sum(of[OURS], "n"), peers={each: _sum(of[each], "broken") for each in PEERS},
            note=(
                f"urgent messages that waited longer than `sdrlinkctl plan` says, in {length_s:g} "
                "s of policy auction, without announced outages; all robots saturate the air with "
                "less urgent classes, move, leave and come back; 5 % of PDUs are lost"
            ),
        )  # fmt: skip
        yield Row(
            f"longest_wait_over_bound_{n}", _over(of[OURS]), "ratio", 1.0, "less",
            _sum(of[OURS], "n"),
            peers={each: _over(of[each]) for each in PEERS}
            | {f"bound_{each}_ms": 1e3 * of[each][0].bound_s for each in of},
            note="the longest wait of an urgent message, over the bound, in the runs above",
        )  # fmt: skip
        yield Row(
            f"urgent_in_outages_pct_{n}", _pct(of[OURS], "in_outages"), "%", None, "less",
            _sum(of[OURS], "n"), peers={each: _pct(of[each], "in_outages") for each in PEERS},
            note="urgent messages that waited while their robot lacked what tells its turns",
        )  # fmt: skip
        yield Row(
            f"urgent_lost_pct_{n}", _pct(of[OURS], "lost"), "%", None, "less",
            _sum(of[OURS], "n"),
            peers={each: _pct(of[each], "lost") for each in PEERS}
            | {"repeated_ms": 1e3 * max(each.repeated_s for each in of[OURS])},
            note=(
                "urgent messages that never came to another robot that was there; repeated_ms: "
                "the longest time from when one left until it came, repeated"
            ),
        )  # fmt: skip


def _run(case: Case) -> Told:
    return strain(*case)


def _sum(runs: list[Told], what: str) -> int:
    return sum(getattr(each, what) for each in runs)


def _pct(runs: list[Told], what: str) -> float:
    return 100 * _sum(runs, what) / max(1, _sum(runs, "n"))


def _over(runs: list[Told]) -> float:
    return max(each.longest_s / each.bound_s for each in runs)
