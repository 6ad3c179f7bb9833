"""What the map shows: robots, their paths, and the links between them."""

from collections.abc import Iterable, Iterator
from typing import Any

from sdrlinkd.reports import EVERYONE, NeighborReport, Snapshot
from sdrlinkd.web.track import Track
from sdrlinkd.web.world import Station, World

SILENT_S = 3.0
"""Time in s after which a robot or a position counts as old."""
FAIR_LOSS, POOR_LOSS = 0.02, 0.15
"""Losses from which a link is fair or poor."""
FAIR_SNR_DB, POOR_SNR_DB = 8.0, 3.0


def map_view(world: World, station: Station | None, now: float) -> dict[str, Any]:
    """Robots and links as JSON: positions as `station` received them, in m.

    A robot without a position has neither `x` nor `y`.
    """
    links = list(_links(world, now))
    known = {robot for link in links for robot in (link["a"], link["b"])}
    known |= {each.robot for each in world.stations.values() if each.robot is not None}
    known |= world.sent.keys() | {robot for _, robot in world.received}
    alive = _alive(world, now)
    robots = [_robot(world, station, robot, alive, now) for robot in sorted(known)]
    return {"robots": robots, "links": links, "flows": _flows(station)}


def map_paths(world: World, station: Station | None) -> list[dict[str, Any]]:
    """The paths of all robots, as they published them and as `station` received them."""
    key = _key_of(world, station)
    found = [
        {"robot": robot, "sent": True, "points": _points(track)}
        for robot, track in world.sent.items()
    ]
    found += [
        {"robot": robot, "sent": False, "points": _points(track)}
        for (at, robot), track in world.received.items()
        if at == key
    ]
    return found


def _robot(
    world: World, station: Station | None, robot: int, alive: set[int], now: float
) -> dict[str, Any]:
    told: dict[str, Any] = {"id": robot, "silent": robot not in alive}
    own = next((each for each in world.stations.values() if each.robot == robot), None)
    if own is not None and own.snapshot is not None:
        told["level"] = "DOWN" if own.is_away(now) else own.snapshot.verdict.level
    track = world.received.get((_key_of(world, station), robot)) or world.sent.get(robot)
    if track is None:
        # Another station may know.
        others = [at for (_, each), at in world.received.items() if each == robot]
        track = max(others, key=lambda each: each.at, default=None)
    if track is not None and track.last is not None:
        x, y, heading, _ = track.last
        told |= {"x": round(x, 3), "y": round(y, 3), "topic": track.topic}
        told |= {"old_s": round(max(0.0, now - track.at), 1)}
        if heading is not None:
            told["heading"] = round(heading, 3)
    return told


def _alive(world: World, now: float) -> set[int]:
    """The robots that report, or that some station hears."""
    found = set()
    for station in world.stations.values():
        if station.snapshot is None or station.is_away(now):
            continue
        found.add(station.snapshot.node)
        heard = station.snapshot.link.neighbors
        found |= {each.src for each in heard if each.last_heard_s_ago < SILENT_S}
    return found


def _links(world: World, now: float) -> Iterator[dict[str, Any]]:
    """Each link once: what its ends measured, else what the team told of it."""
    found: dict[tuple[int, int], dict[str, Any]] = {}
    reporting = [
        each.snapshot
        for each in world.stations.values()
        if each.snapshot is not None and not each.is_away(now)
    ]
    for snapshot in reporting:
        for each in snapshot.link.neighbors:
            if not each.is_self and each.last_heard_s_ago < SILENT_S:
                _note(found, snapshot.node, each)
    for snapshot in reporting:
        _note_told(found, snapshot)
    for link in found.values():
        link["level"] = _level(link)
        yield link


def _note(found: dict[tuple[int, int], dict[str, Any]], own: int, each: NeighborReport) -> None:
    """What one end of a link says: of its reception, and, second hand, of the other's."""
    a, b = sorted((own, each.src))
    link = found.setdefault((a, b), {"a": a, "b": b})
    here, there = ("a", "b") if own == a else ("b", "a")
    # `snr_a` and `loss_a` are measured at the end `a`.
    link |= {f"snr_{here}": each.snr_db, f"loss_{here}": each.per_lately}
    link[f"mcs_{here}"] = each.mcs
    link[f"hops_{here}"] = each.hops_left
    link.setdefault(f"snr_{there}", each.snr_there_db)
    link.setdefault(f"loss_{there}", each.per_there)


def _note_told(found: dict[tuple[int, int], dict[str, Any]], snapshot: Snapshot) -> None:
    for told in snapshot.link.routes.robots:
        for other, share in told.hears.items():
            a, b = sorted((told.id, other))
            if (a, b) not in found or "told" in found[a, b]:
                link = found.setdefault((a, b), {"a": a, "b": b, "told": True})
                link[f"loss_{'a' if told.id == a else 'b'}"] = round(1 - share, 3)


def _level(link: dict[str, Any]) -> str:
    losses = [link[key] for key in ("loss_a", "loss_b") if link.get(key) is not None]
    snrs = [link[key] for key in ("snr_a", "snr_b") if link.get(key) is not None]
    loss, snr_db = max(losses, default=0.0), min(snrs, default=99.0)
    if loss >= POOR_LOSS or snr_db < POOR_SNR_DB:
        return "poor"
    return "fair" if loss >= FAIR_LOSS or snr_db < FAIR_SNR_DB else "good"


def _flows(station: Station | None) -> list[dict[str, Any]]:
    """What goes through the station's robot, and who is to forward it next."""
    if station is None or station.snapshot is None:
        return []
    return [
        {
            "from": station.snapshot.node,
            "src": each.src,
            "dst": None if each.dst == EVERYONE else each.dst,
            "via": each.forwarded_by,
        }
        for each in station.snapshot.link.routes.flows
        if each.forwarded_by
    ]


def _points(track: Track) -> list[tuple[float, float]]:
    return [(round(x, 2), round(y, 2)) for x, y in track.points]


def _key_of(world: World, station: Station | None) -> str:
    keys: Iterable[str] = (key for key, each in world.stations.items() if each is station)
    return next(iter(keys), "")
