"""All rows: `python -m benchmarks.team`."""

import sys
from collections.abc import Iterator
from statistics import median

from benchmarks.report import Row, exactly, main
from benchmarks.team import crowd_rows, rtwmp_rows, worst_rows
from benchmarks.team.chain import Carried, carry
from benchmarks.team.driving import AFTER_S, BEFORE_S, HEARD_DB, SIDE_M, drive
from benchmarks.team.healing import PERIOD_S, heal
from benchmarks.team.turnaround import wait_for_turns


def measure(seed: int, quick: bool) -> Iterator[Row]:
    """Measure all rows; `quick` takes a tenth of the trials."""
    yield from exactly(_chain(seed, quick))
    yield from exactly(_chain5(seed, quick))
    yield from exactly(_driving(seed, quick))
    yield from exactly(_turnaround(seed, quick))
    yield from exactly(crowd_rows.rows(seed, quick))
    yield from exactly(worst_rows.rows(seed, quick))
    n = 2 if quick else 20
    for name, to_all in (("reroute_s", False), ("reroute_to_all_s", True)):
        found = [heal(seed + i, to_all=to_all) for i in range(n)]
        yield Row(
            name, max(each.back_s for each in found), "s", 0.4, "less", n,
            peers={
                "median_s": median(each.back_s for each in found),
                "messages_lost": sum(each.lost for each in found),
                "messages": sum(each.sent for each in found),
                "control_pct": 100 * max(each.control_share for each in found),
            },
            note=(
                f"five robots, {1 / PERIOD_S:g} Hz over three hops, tdma; the worst of all trials: "
                "from the death of the relay until the first message that was sent after it"
            ),
            exact=True,
        )  # fmt: skip
    yield from exactly(rtwmp_rows.rows(seed, quick))


def _chain(seed: int, quick: bool) -> Iterator[Row]:
    duration_s = 8.0 if quick else 210.0
    ours = carry("grant", seed, duration_s)
    others: dict[str, Carried] = {
        policy: carry(policy, seed, duration_s if quick else 30.0)
        for policy in ("tdma", "minislot", "csma")
    }
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


def _chain5(seed: int, quick: bool) -> Iterator[Row]:
    duration_s = 4.0 if quick else 60.0
    ours = carry("grant", seed, duration_s, n=5, load=0.5)
    tdma = carry("tdma", seed, duration_s if quick else 15.0, n=5, load=0.5)
    for i, (name, target) in enumerate((("laser", 0.999), ("image", 0.999), ("joystick", 0.999))):
        yield Row(
            f"chain5_mdr_{name}", ours.mdr[i], "ratio", target, "more", ours.sent[i],
            peers={
                "tdma": tdma.mdr[i],
                "mean_ms": 1e3 * ours.mean_s[i],
                "asked_pct": 100 * ours.asked / ours.pdus,
            },
            note=(
                "the same flows over four hops, each half as often; they begin after 8 s, when "
                "the team has found its routes; policy grant; asked: PDUs of which a robot asked "
                "another one, of those forwarded"
            ),
        )  # fmt: skip


def _driving(seed: int, quick: bool) -> Iterator[Row]:
    ours = drive("grant", seed, 15.0 if quick else 600.0)
    for qos, target in (("urgent", 0.9999), ("latency", 0.999), ("default", 0.99)):
        yield Row(
            f"mobile_8_mdr_{qos}", ours.mdr(qos), "ratio", target, "more", ours.sent[qos],
            peers={"hops": ours.hops, "without_path": ours.without_path[qos]},
            note=(
                f"seven robots drive in a square of {SIDE_M:g} m, a base stands at its edge: "
                "odometry and status to the base, commands from it; messages count if there was a "
                f"path of links of {HEARD_DB:g} dB or more from {BEFORE_S:g} s before them to "
                f"{AFTER_S:g} s after; policy grant"
            ),
        )  # fmt: skip


def _turnaround(seed: int, quick: bool) -> Iterator[Row]:
    for name, size, target in (("standing", 64, 1.2), ("request", 2048, 2.3)):
        found = wait_for_turns(size, seed, 30.0 if quick else 300.0)
        rounds = found.p99_s / found.longest_round_s
        yield Row(
            f"grant_halfduplex_50ms_urgent_p99_over_frame_{name}", rounds, "rounds", target, "less",
            found.n, peers={"mdr": found.mdr, "longest_round_ms": 1e3 * found.longest_round_s},
            note=(
                "five radios, turnaround 50 ms; four have more bulk than the air carries, the "
                f"fifth sends {size} B at random, once a second; a frame is the longest round; "
                "a message that goes on later than 1 s after it was begun is given up, see mdr"
            ),
        )  # fmt: skip


if __name__ == "__main__":
    sys.exit(main("team", measure))
