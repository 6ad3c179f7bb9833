"""Decides what becomes of each topic that nodes of this robot publish."""

from collections.abc import Container, Iterable, Mapping
from typing import NamedTuple

from sdrlink_ros.names import Names, command_name, left_out, matches
from sdrlink_ros.offer import Offer
from sdrlink_ros.settings import Settings

TF_STATIC = "/tf_static"
UNKNOWN_DEPTH = 5
"""Depth of a latched or best-effort publisher that does not tell it: that of SensorDataQoS."""
MOST_LATCHED, MOST_WAITING = 255, 10_000


class Route(NamedTuple):
    """A topic for other robots: its name on the bus, and the robot that it commands, if any.

    `is_eager`: it is sent even if nobody is known to want it.
    """

    offer: Offer
    bus: str
    robot: int | None
    is_eager: bool

    @property
    def depth(self) -> int:
        """How many of its messages may wait; of a latched topic, how many late joiners get.

        0: what the daemon finds right.
        """
        offer = self.offer
        if offer.is_latched and offer.name == TF_STATIC:
            # Its producers are told apart by their frames, and each has a last message.
            return 1
        each = offer.depth or (offer.is_latched or not offer.is_reliable) * UNKNOWN_DEPTH
        # ROS does not say who sent a message, so there is room for the messages of each publisher.
        return min(each * offer.n_publishers, MOST_LATCHED if offer.is_latched else MOST_WAITING)


class Routes(NamedTuple):
    """`taken` topics by name, and why others are left out or `refused`, in words by name."""

    taken: dict[str, Route]
    left_out: dict[str, str]
    refused: dict[str, str]


def decide(
    offers: Mapping[str, Offer],
    settings: Settings,
    names: Names,
    heard: Container[tuple[int, str]],
) -> Routes:
    """The routes of all topics; `heard` holds (robot, name) of what other robots declare."""
    routes = Routes({}, {}, {})
    for name, offer in sorted(offers.items()):
        if len(offer.kinds) > 1:
            routes.refused[name] = (
                f"{name}: nodes here publish it as {' and as '.join(offer.kinds)}; use one type"
            )
            continue
        address = names.address(name)
        if address is not None and address.robot != names.own:
            _command(routes, offer, address.robot, address.name, settings, heard)
            continue
        local = names.local(name)
        if matches(local, settings.commands):
            routes.left_out[name] = "a command; those never go the other way"
        elif reason := left_out(local, offer.kind, settings.allow, settings.deny):
            routes.left_out[name] = reason
        else:
            is_eager = matches(local, settings.eager) or matches(name, settings.eager)
            routes.taken[name] = Route(offer, local, None, is_eager)
    _refuse_twins(routes)
    return routes


def _command(
    routes: Routes,
    offer: Offer,
    robot: int,
    name: str,
    settings: Settings,
    heard: Container[tuple[int, str]],
) -> None:
    if matches(offer.name, settings.deny):
        routes.left_out[offer.name] = "denied by the parameter deny"
    elif not 1 <= robot <= 254:
        routes.refused[offer.name] = f"{offer.name}: {robot} is no robot's id (1 to 254)"
    elif (robot, name[1:]) in heard and not matches(name, settings.commands):
        routes.refused[offer.name] = (
            f"{offer.name}: robot {robot} sends it, and {_listed(offer.nodes)} here commands it; "
            "give one of them another name, or add it to the parameter commands at both robots"
        )
    else:
        bus = f"/{command_name(robot, name)}"
        routes.taken[offer.name] = Route(offer, bus, robot, True)


def _refuse_twins(routes: Routes) -> None:
    """Refuse topics that have one name on the air, with and without the robot's prefix."""
    by_bus: dict[str, list[str]] = {}
    for name, route in routes.taken.items():
        by_bus.setdefault(route.bus, []).append(name)
    for twins in by_bus.values():
        for name in twins[1:]:
            del routes.taken[name]
            routes.refused[name] = f"{name}: on the air it has the name of {twins[0]}; use one"


def _listed(nodes: Iterable[str]) -> str:
    return " and ".join(nodes)
