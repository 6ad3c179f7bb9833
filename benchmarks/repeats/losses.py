"""When an air loses what is sent: random, in bursts, by burst, or as recorded."""

from collections.abc import Callable
from pathlib import Path
from random import Random

import numpy as np

Losses = Callable[[float], bool]
"""Whether a PDU is lost whose middle is on the air at this time in s; times do not decrease."""
MEAN_BAD_S = 0.05
"""Mean length in s of a time in which everything is lost."""
RECORDED_S = 0.01
"""Time in s for which one packet of a recorded trace stands."""


def independent(share: float, seed: int) -> Losses:
    """Each PDU is lost with the same probability."""
    rng = Random(seed)
    return lambda _: rng.random() < share


def in_bursts(share: float, seed: int) -> Losses:
    """Everything is lost for a share of the time, in pieces of MEAN_BAD_S on average.

    This is the model of Gilbert and Elliott, in which nothing is lost in between.
    """
    rng = Random(seed)
    mean_s = {True: MEAN_BAD_S, False: MEAN_BAD_S * (1 - share) / share}
    state = {"bad": False, "until": rng.expovariate(1 / mean_s[False])}

    def lost(at: float) -> bool:
        while at >= state["until"]:
            state["bad"] = not state["bad"]
            state["until"] += rng.expovariate(1 / mean_s[bool(state["bad"])])
        return bool(state["bad"])

    return lost


def recorded(folder: Path, least: float, most: float, seed: int) -> Losses:
    """The links of a recorded testbed that lose such a share, one after the other, again and again.

    `folder` has orbit_links_rssi.npz: by link and packet the signal's strength, 255 where the
    packet was lost.
    """
    with np.load(folder / "orbit_links_rssi.npz") as file:
        lost = np.asarray(file["rssi"]) == 255
    shares = lost.mean(axis=1)
    links = lost[(shares >= least) & (shares <= most)]
    if not len(links):
        raise ValueError(f"no link of {folder} loses {least:g} to {most:g} of its packets")
    np.random.default_rng(seed).shuffle(links)
    packets = links.ravel()
    return lambda at: bool(packets[int(at / RECORDED_S) % len(packets)])
