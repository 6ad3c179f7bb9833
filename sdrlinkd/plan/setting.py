"""Derives the setting of a plan from a configuration."""

from collections.abc import Sequence
from random import Random

import msgspec

from backends import SPEED_OF_LIGHT
from sdrlinkd.config import Config
from sdrlinkd.errors import ConfigError, UserError
from sdrlinkd.link import PduLinkTraits, Settled, longest_burst_s, percent, settle
from sdrlinkd.modem import PresumedRadio, presume_radio
from sdrlinkd.plan.air import Setting
from sdrlinkd.plan.bounds import AccessBound, access_bounds

HOST_S = 0.01
"""Largest latency in s that the machines at both ends add (buses, event loops and demodulation), on
a machine with two cores that also runs other programs."""


LAST_ID = 254
MOST_ROBOTS = 32
"""Most robots of a plan."""


def setting_of(
    config: Config,
    own_id: int,
    robots: int | None = None,
    turnaround_s: float | None = None,
    host_s: float = HOST_S,
    has_numbers: bool = False,
    speed_m_s: float = 0.0,
) -> Setting:
    """The setting for `robots` robots (default: as access.nodes lists), which all send the same.

    `has_numbers` as in Setting. `turnaround_s` replaces the radio's configured turnaround. With
    `speed_m_s`, robots move past each other so fast. Raises UserError, ConfigError.
    """
    radio = presume_radio(config, turnaround_s)
    access = config.access
    guessed: list[str] = []
    if robots is not None:
        if not 1 <= robots <= MOST_ROBOTS:
            raise UserError(f"--robots: got {robots}; allowed: 1 to {MOST_ROBOTS}")
        policy = access.policy if robots > 1 else "none"
        nodes, own_id = list(range(1, robots + 1)), 1
        access = msgspec.structs.replace(access, policy=policy, nodes=nodes)
    if access.policy == "csma" and not access.nodes:
        access = msgspec.structs.replace(access, nodes=[own_id, own_id % LAST_ID + 1])
        guessed = ["access.nodes is empty: planned for two robots (--robots)"]
    elif not access.nodes:
        guessed = ["access.nodes is empty: planned for one robot (--robots)"]
    n = max(1, len(set(access.nodes)))
    if n > MOST_ROBOTS:
        raise UserError(f"access.nodes: got {n} robots; allowed in a plan: at most {MOST_ROBOTS}")
    forced = msgspec.structs.replace(access, force=True)
    settled = settle(forced, own_id, radio.traits, radio.longest_s, Random(0), config.record_room)
    notes = guessed + _notes(config, radio, settled, n, host_s)
    try:
        settle(access, own_id, radio.traits, radio.longest_s, Random(0), config.record_room)
    except ConfigError as error:
        notes.append(f"the daemon refuses this: {error}")
    modem = config.modem
    longest_s = radio.traits.longest_burst_s[modem.mcs]
    one_s = radio.airtimes.airtime_s(modem.mcs, 1)
    if speed_m_s:
        doppler_hz = speed_m_s * modem.centre_hz / SPEED_OF_LIGHT
        longest_s = max(one_s, min(longest_s, longest_burst_s(doppler_hz)))
        notes.append(_moving(speed_m_s, modem.centre_hz, doppler_hz, longest_s))
    bounds = access_bounds(settled, radio.traits, n, radio.longest_s, one_s)
    return Setting(
        radio.airtimes, config.inner_pdu_size, modem.mcs, longest_s, config.classes, n, settled,
        radio.traits, host_s, has_numbers, config.repeat.share, tuple(bounds), tuple(notes),
    )  # fmt: skip


def bounds_of(
    config: Config, own_id: int, robots: Sequence[int], turnaround_s: float | None = None
) -> tuple[list[AccessBound], list[str]]:
    """(bounds for each number of robots, why there are none for some). Raises UserError."""
    found: list[AccessBound] = []
    notes: list[str] = []
    for n in robots:
        try:
            found += setting_of(config, own_id, n, turnaround_s).bounds
        except ConfigError as error:
            notes.append(f"{n} robots: {error}")
    return found, notes


def _notes(
    config: Config, radio: PresumedRadio, settled: Settled, n: int, host_s: float
) -> list[str]:
    rate = f"{config.modem.rate_hz / 1e6:g} Msps"
    if config.modem.oversampling > 1:
        rate += f" (the radio at {config.modem.rate_hz * config.modem.oversampling / 1e6:g} Msps)"
    who = "one robot" if n == 1 else f"{n} robots"
    notes = [f"{who}, {rate}, access {settled.sentence}"]
    if radio.presumption:
        notes.append(f"radio: {radio.presumption}")
    notes.append(_times(radio.traits, host_s))
    if n > 1 and settled.policy == "none":
        notes.append(
            f"without an access policy, simultaneous bursts of {n} robots collide on a shared "
            f"channel; this plan ignores that (alone, each can use up to {percent(settled.share)})"
        )
    if config.repeat.share:
        notes.append(
            "PDUs that are lost are sent again, later than this; "
            f"{percent(config.repeat.share)} of the air is left for that (repeat.share)"
        )
    if settled.policy == "csma":
        notes.append(
            "csma: collided bursts are lost, and one message in a hundred waits longer than this"
        )
    return notes


def _moving(speed_m_s: float, centre_hz: float, doppler_hz: float, longest_s: float) -> str:
    return (
        f"at {speed_m_s:.3g} m/s and {1e-9 * centre_hz:.3g} GHz, channels change at "
        f"{doppler_hz:.2g} Hz: bursts are at most {1e3 * longest_s:.2g} ms long"
    )


def _times(traits: PduLinkTraits, host_s: float) -> str:
    windows = ""
    if traits.tx_window_s < float("inf"):
        windows = f", {1e3 * traits.rx_window_s:.0f} ms between two TX windows"
    return (
        f"turn includes: lead {1e3 * traits.lead_s:.3g} ms{windows}; rest is: reception "
        f"{1e3 * traits.react_s:.3g} ms, hosts {1e3 * host_s:.3g} ms (--host; `sdrlinkctl doctor` "
        "measures it)"
    )
