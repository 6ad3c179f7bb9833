"""Where the nodes of a simulated air are, and how well they hear each other."""

import math
from bisect import bisect_right
from collections.abc import Mapping, Sequence
from typing import Annotated, Literal, NamedTuple

import msgspec
from msgspec import Meta

from backends.params import Decibel, JammerParams

SPEED_OF_LIGHT = 299_792_458.0
LEAST_DISTANCE_M = 1.0

NEVER_OFF: Mapping[int, Sequence["Outage"]] = {}


class AirParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The shared air. SNR is mean burst power over the receiver's noise in the band."""

    rate_hz: Annotated[float, Meta(ge=1e4, le=2e8)] = 5e6
    frequency_hz: Annotated[float, Meta(ge=0, le=1e11)] = 2.45e9
    profile: Literal["awgn", "rayleigh", "tdl-a", "tdl-c"] = "awgn"
    """A single path, or echoes that fade anew for each burst, and within it as the nodes move."""
    delay_spread_s: Annotated[float, Meta(ge=0, le=1e-3)] = 1e-7
    snr_db: Decibel = 20.0
    """SNR between nodes without positions, unless a link overrides it."""
    snr_db_at_1m: Decibel = 60.0
    """SNR at a distance of 1 m, between nodes that have positions."""
    path_loss_exponent: Annotated[float, Meta(ge=0, le=8)] = 2.0
    block_s: Annotated[float, Meta(ge=1e-5, le=0.1)] = 0.001
    """Length of the pieces in which samples are handed out."""
    jammer: list[JammerParams] = []
    """Signals of others, which all nodes receive alike."""


class RadioParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The radio of one node, as its scenario sets it."""

    full_duplex: bool = True
    turnaround_s: Annotated[float, Meta(ge=0, le=1)] = 0.0
    """Time before and after each burst in which a half-duplex radio hears nothing."""
    timestamps: bool = True
    index_error_s: Annotated[float, Meta(ge=0, le=0.1)] = 0.0
    """Without time stamps: possible error of the sample count after each burst."""
    clock_ppm: Annotated[float, Meta(ge=-200, le=200)] = 0.0
    """Frequency error of its crystal, which drives centre frequency and sampling clock."""
    image_db: Decibel = 300.0
    dc_dbfs: Annotated[float, Meta(ge=-300, le=0)] = -300.0
    adc_bits: Annotated[int, Meta(ge=0, le=24)] = 0


class LinkOverride(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """How one node hears another, regardless of positions; both ways unless `one_way`."""

    sender: Annotated[int, Meta(ge=0, le=254)]
    receiver: Annotated[int, Meta(ge=0, le=254)]
    snr_db: Decibel | None = None
    """SNR of the link; absent: computed from the positions. -300: nothing arrives."""
    delay_s: Annotated[float, Meta(ge=0, le=1)] = 0.0
    one_way: bool = False


class Outage(NamedTuple):
    """A period, `begin_s` to `end_s`, in which nothing arrives."""

    begin_s: float
    end_s: float


class Hop(NamedTuple):
    """How a burst gets from one node to another."""

    snr_db: float
    delay_s: float
    doppler_ppm: float
    speed_m_s: float = 0.0
    """How fast the nodes move relative to each other, in any direction."""


class Track:
    """A node's path: straight lines between waypoints (t in s, x and y in m); stays at the last."""

    def __init__(self, waypoints: Sequence[tuple[float, float, float]]) -> None:
        self._times = [t for t, _, _ in waypoints]
        self._places = [(x, y) for _, x, y in waypoints]

    def at(self, t: float) -> tuple[float, float]:
        """The position in m at a time in s."""
        after = bisect_right(self._times, t)
        if after == 0:
            return self._places[0]
        if after == len(self._times):
            return self._places[-1]
        t0, t1 = self._times[after - 1], self._times[after]
        share = (t - t0) / (t1 - t0)
        (x0, y0), (x1, y1) = self._places[after - 1], self._places[after]
        return x0 + share * (x1 - x0), y0 + share * (y1 - y0)


class World:
    """The air between all pairs of nodes, at any time; `off`: when the radios of some are off."""

    def __init__(
        self,
        air: AirParams,
        tracks: dict[int, Track],
        links: Sequence[LinkOverride] = (),
        outages: Sequence[Outage] = (),
        off: Mapping[int, Sequence[Outage]] = NEVER_OFF,
    ) -> None:
        self._air = air
        self._off = {node: _Times(times) for node, times in off.items()}
        self._tracks = tracks
        self._outages = _Times(outages)
        self._links: dict[tuple[int, int], LinkOverride] = {}
        for link in links:
            self._links[link.sender, link.receiver] = link
            if not link.one_way:
                self._links.setdefault((link.receiver, link.sender), link)

    def hop(self, sender: int, receiver: int, t: float) -> Hop | None:
        """The hop from sender to receiver at time `t`; None when nothing arrives."""
        if self.is_out(t) or self.is_off(sender, t) or self.is_off(receiver, t):
            return None
        link = self._links.get((sender, receiver))
        distance_m, away_m_s, speed_m_s = self._distance(sender, receiver, t)
        delay_s = distance_m / SPEED_OF_LIGHT + (link.delay_s if link else 0.0)
        snr_db = link.snr_db if link else None
        if snr_db is None:
            snr_db = self._air.snr_db
            if sender in self._tracks and receiver in self._tracks:
                away = max(distance_m, LEAST_DISTANCE_M)
                loss_db = 10 * self._air.path_loss_exponent * math.log10(away)
                snr_db = self._air.snr_db_at_1m - loss_db
        if snr_db <= -300:
            return None
        return Hop(snr_db, delay_s, -1e6 * away_m_s / SPEED_OF_LIGHT, speed_m_s)

    def is_out(self, t: float) -> bool:
        """Whether there is an outage at `t`."""
        return self._outages.hold(t)

    def is_off(self, node: int, t: float) -> bool:
        """Whether the radio of a node is off at `t`."""
        times = self._off.get(node)
        return times is not None and times.hold(t)

    def _distance(self, sender: int, receiver: int, t: float) -> tuple[float, float, float]:
        """(distance in m, its rate of growth, relative speed in m/s); 0 without positions."""
        one, other = self._tracks.get(sender), self._tracks.get(receiver)
        if one is None or other is None:
            return 0.0, 0.0, 0.0
        step_s = 0.01
        (x0, y0), (x1, y1) = (
            tuple(a - b for a, b in zip(one.at(each), other.at(each), strict=True))
            for each in (t, t + step_s)
        )
        now, then, moved = math.hypot(x0, y0), math.hypot(x1, y1), math.hypot(x1 - x0, y1 - y0)
        return now, (then - now) / step_s, moved / step_s


class _Times:
    """Periods in order, merged where they overlap."""

    def __init__(self, periods: Sequence[Outage]) -> None:
        self._periods = _merged(periods)
        self._ends = [each.end_s for each in self._periods]

    def hold(self, t: float) -> bool:
        """Whether `t` is in one of them."""
        i = bisect_right(self._ends, t)
        return i < len(self._periods) and self._periods[i].begin_s <= t


def _merged(outages: Sequence[Outage]) -> list[Outage]:
    """The outages in order, merged where they overlap."""
    apart: list[Outage] = []
    for outage in sorted(outages):
        if apart and outage.begin_s <= apart[-1].end_s:
            apart[-1] = Outage(apart[-1].begin_s, max(apart[-1].end_s, outage.end_s))
        else:
            apart.append(outage)
    return apart
