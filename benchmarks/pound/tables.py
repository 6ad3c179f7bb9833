"""Tables I to IV: a laser and a camera over one hop and over two; VI-H: more of both."""

from typing import NamedTuple

import numpy as np

from backends import LinkOverride
from benchmarks.flows import Figures, Flow, Trace, figures
from benchmarks.pound.ours import Air, Run, Sent, run

LASERS = 1000
LASER_S = 0.02
IMAGE_S = 0.15
IMAGE_3N_S = 0.3
KB = 1024
IMAGE = 65536
BLOCK_3N_S = 5e-5
TURNAROUND_S = 1e-4
"""Of half-duplex radios."""
FAR_DB = 4.0
"""SNR over two hops at once: the signal is sensed but not decoded."""


class Case(NamedTuple):
    """How the laser keeps time: exactly, with jitter, or drifting against the camera."""

    name: str = ""
    jitter_s: float = 0.0
    drift: float = 0.0


EXACT = Case()
DRIFTING = Case("drift_0.3pct", 0.0, 3e-3)
CASES = (Case("jitter_0.5ms", 5e-4), Case("jitter_2ms", 2e-3), DRIFTING)


def flows(n_hops: int, case: Case, seed: int, quick: bool) -> tuple[Flow, Flow]:
    """(laser, image), with random phases."""
    rng = np.random.default_rng(seed)
    n = LASERS // 2 if quick else LASERS
    image_s = IMAGE_S if n_hops == 1 else IMAGE_3N_S
    laser = Flow(
        "laser", KB, LASER_S, n, "latency", case.jitter_s, case.drift, rng.uniform(0, LASER_S)
    )
    image = Flow(
        "image", IMAGE, image_s, int(n * LASER_S / image_s), "bulk", phase_s=rng.uniform(0, image_s)
    )
    return laser, image


def two_nodes(seed: int, quick: bool, case: Case = EXACT) -> Run:
    """The run of Tables I and II."""
    laser, image = flows(1, case, seed, quick)
    return run([Sent(laser, 1, 2), Sent(image, 1, 2)], Air(), seed)


def chain(n_nodes: int) -> Air:
    """Nodes in a row that hear their neighbors; they only sense the others."""
    ids = range(1, n_nodes + 1)
    far = [
        LinkOverride(sender=a, receiver=b, snr_db=FAR_DB, one_way=False)
        for a in ids
        for b in ids
        if b > a + 1
    ]
    routes = {node: [f"1>{n_nodes}", f"{n_nodes}>1"] for node in ids if 1 < node < n_nodes}
    return Air(
        nodes=n_nodes, policy="minislot", full_duplex=False, turnaround_s=TURNAROUND_S,
        overrides=far, routes=routes, block_s=BLOCK_3N_S,
    )  # fmt: skip


def three_nodes(seed: int, quick: bool, case: Case = EXACT) -> Run:
    """The run of Tables III and IV."""
    laser, image = flows(2, case, seed, quick)
    return run([Sent(laser, 1, 3), Sent(image, 1, 3)], chain(3), seed)


def four_nodes(seed: int, quick: bool) -> Run:
    """VI-H: three hops, and commands against the stream."""
    laser, _ = flows(2, EXACT, seed, quick)
    slow = laser._replace(period_s=0.04, count=laser.count // 2)
    image = Flow(
        "image", IMAGE, 0.6, max(3, int(laser.count * LASER_S / 0.6)), "bulk", phase_s=0.11
    )
    joystick = Flow("joystick", 64, 0.1, laser.count // 5, "latency", phase_s=0.033)
    return run([Sent(slow, 1, 4), Sent(image, 1, 4), Sent(joystick, 4, 1)], chain(4), seed)


def opposing(seed: int, quick: bool) -> Run:
    """VI-H: the same traffic both ways at the same time, on one channel."""
    laser, image = flows(1, EXACT, seed, quick)
    slow = image._replace(period_s=0.4, count=max(3, image.count * 3 // 8))
    back = (
        laser._replace(name="laser_back", phase_s=laser.phase_s / 2),
        slow._replace(name="image_back"),
    )
    air = Air(
        policy="minislot", full_duplex=False, turnaround_s=TURNAROUND_S, block_s=BLOCK_3N_S
    )  # fmt: skip
    sent = [Sent(laser, 1, 2), Sent(slow, 1, 2), *(Sent(flow, 2, 1) for flow in back)]
    return run(sent, air, seed)


def by_flow(traces: list[Trace]) -> dict[str, Figures]:
    """The rows of a table, by flow."""
    return {trace.flow.name: figures(trace) for trace in traces}
