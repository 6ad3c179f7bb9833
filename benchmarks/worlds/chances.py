"""When a simulated robot looks again whether it may send."""

from benchmarks.worlds.burst_channel import AirSense
from benchmarks.worlds.station import Station
from sdrlinkd.link import MARGIN_S, AccessParams, Sensed

INFINITE = float("inf")
LIKE_NEW_S = 0.005
"""Time of silence in s in which mini-slots grow by less than ALMOST_S."""
ALMOST_S = 4e-6
ASKED_S = 5e-3
"""How often a robot is asked that waits for a plan of turns, in s."""


def at_pace(sensed: AirSense, pace: float) -> Sensed:
    """What a receiver knows, in the time of its robot."""
    until, idle_since, burst_at, carrier_end, carrier_at, pulses = sensed
    return Sensed(
        until * pace,
        idle_since * pace,
        None if burst_at is None else burst_at * pace,
        carrier_end * pace,
        None if carrier_at is None else carrier_at * pace,
        tuple(each * pace for each in pulses),
    )


def next_chance(
    station: Station, name: str, access: AccessParams, sensed: Sensed, t: float
) -> float:
    """Earliest time after `t` at which the link can decide differently, if nothing new arrives.

    All times are by the station's clock. In tdma that is its own slot. With reuse it is also the
    slots before that, at its mini-slots after their start or after the end of a burst in them.
    """
    policy, traits = station.settled.access, station.traits
    if policy.by_request is not None:
        turn_at = policy.by_request.turn_at(t + traits.lead_s) - traits.lead_s - traits.react_s
        # Whoever waits for a plan is asked, too, to notice that nobody plans.
        into_s = t % ASKED_S
        asked_at = t if into_s <= traits.ahead_s else t - into_s + ASKED_S
        return max(t, min(turn_at, asked_at))
    frame = policy.frame(t + traits.lead_s)
    carrier_end = -INFINITE if sensed.burst_at is None else sensed.idle_since
    if name == "auction":
        t = max(t, sensed.carrier_end, station.free_at - traits.lead_s)
        return _next_mini_slot(station, max(sensed.carrier_end, policy.own_end), t)
    if name in ("csma", "minislot"):
        return max(t, carrier_end, station.free_at - traits.gap_s)
    if frame is None:
        return t
    n, phase_s = len(access.nodes), 1e-6 * frame.phase_us
    rank, slot_s = access.nodes.index(station.link.own_id), policy.round_s / n
    minislot_s = access.minislot_s or traits.lead_s + traits.react_s + traits.detect_s
    first = int(phase_s / slot_s)
    begin = t + traits.lead_s - phase_s + first * slot_s
    turns = (rank - first) % n
    own = begin + turns * slot_s - traits.lead_s - traits.react_s - traits.ahead_s
    for turn in range(turns, 0, -1):
        look = max(begin - minislot_s, carrier_end) + turn * minislot_s
        begin += slot_s
        soonest = max(t + traits.lead_s, look + minislot_s)
        if access.reuse and soonest + station.least_s < begin:
            return max(t, min(look, own))
    return max(t, own)


def _next_mini_slot(station: Station, idle_since: float, t: float) -> float:
    """Earliest time from `t` on at which an auction decides on one of its mini-slots.

    That is once all before a mini-slot is known, and until it is too late for it.
    """
    traits, minislot_s = station.traits, station.settled.access.pause_s / 2
    since_s = t - idle_since
    if not 0 <= since_s < LIKE_NEW_S:
        # Mini-slots grow with the time of silence.
        return t
    known_s = traits.pulse_s + 1.5 * traits.detect_s + MARGIN_S - ALMOST_S
    into_s = since_s % minislot_s
    if known_s <= into_s <= minislot_s - traits.lead_s + ALMOST_S:
        return t
    return t - into_s + known_s + minislot_s * (into_s > known_s)
