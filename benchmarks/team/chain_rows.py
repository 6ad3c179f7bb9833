"""The rows on the paper's chain of robots, and on a longer one."""

from collections.abc import Iterator
from functools import partial

from benchmarks.report import Row
from benchmarks.team.chain import Carried, carry
from benchmarks.team.runs import Run, Runs, results
from benchmarks.team.teams import Policy

PEERS: tuple[Policy, ...] = ("tdma", "minislot", "csma")


def rows(runs: Runs, seed: int, quick: bool) -> Iterator[Row]:
    """What becomes of laser, image and joystick over two and four hops."""

    def run(policy: Policy, duration_s: float, n: int = 3, load: float = 1.0) -> Run[Carried]:
        what = partial(carry, policy, seed, duration_s, n=n, load=load)
        return runs.add(f"chain of {n}, {policy}", n * duration_s, what)

    ours = run("grant", 8.0 if quick else 210.0)
    peers = {policy: run(policy, 8.0 if quick else 30.0) for policy in PEERS}
    longer = run("grant", 4.0 if quick else 60.0, 5, 0.5)
    tdma = run("tdma", 4.0 if quick else 15.0, 5, 0.5)

    def found() -> Iterator[Row]:
        yield from _chain(ours.result(), results(peers))
        yield from _chain5(longer.result(), results({"tdma": tdma}))

    return found()


def _chain(ours: Carried, others: dict[Policy, Carried]) -> Iterator[Row]:
    note = (
        "the paper's chain: laser (1 KiB, 50 Hz) and image (64 KiB, every 300 ms) one way, the "
        "joystick (64 B, 10 Hz) back; the ends do not hear each other; policy grant"
    )
    for i, (name, target) in enumerate((("laser", 0.9999), ("image", 0.999), ("joystick", 0.9999))):
        yield Row(
            f"chain3_seed_mdr_{name}", ours.mdr[i], "ratio", target, "more", ours.sent[i],
            peers={policy: each.mdr[i] for policy, each in others.items()}, note=note,
        )  # fmt: skip
    for i, name in ((0, "laser"), (2, "joystick")):
        yield Row(
            f"chain3_seed_{name}_D_ms", 1e3 * ours.mean_s[i], "ms", 6.0, "less", ours.sent[i],
            peers={policy: 1e3 * each.mean_s[i] for policy, each in others.items()}, note=note,
        )  # fmt: skip


def _chain5(ours: Carried, others: dict[str, Carried]) -> Iterator[Row]:
    for i, (name, target) in enumerate((("laser", 0.999), ("image", 0.999), ("joystick", 0.999))):
        yield Row(
            f"chain5_mdr_{name}", ours.mdr[i], "ratio", target, "more", ours.sent[i],
            peers={policy: each.mdr[i] for policy, each in others.items()}
            | {
                "mean_ms": 1e3 * ours.mean_s[i],
                "asked_pct": 100 * ours.asked / ours.pdus,
            },
            note=(
                "the same flows over four hops, each half as often; they begin after 8 s, when "
                "the team has found its routes; policy grant; asked: PDUs of which a robot asked "
                "another one, of those forwarded"
            ),
        )  # fmt: skip
