"""What the bridge tells people of itself: in a sentence, and of each topic."""

from typing import Any

from sdrlink_ros.incoming import Incoming
from sdrlink_ros.outgoing import Outgoing
from sdrlink_ros.routes import Routes
from sdrlink_ros.services import Services


def in_words(routes: Routes, outgoing: Outgoing, incoming: Incoming) -> str:
    """The bridge in one sentence, for `sdrlinkctl status`."""
    taker, outlets = outgoing.taker, incoming.outlets
    wanted_here = len(incoming.wanted & set(outlets))
    words = (
        f"ROS bridge: topics out {len(routes.taken)} (wanted {len(taker.taps)}), "
        f"in {len(outlets)} (wanted {wanted_here})"
    )
    refused = len(routes.refused) + len(outgoing.refused) + len(incoming.refused)
    if refused:
        words += f"; {refused} refused, see /link/topics"
    if lost := taker.lost.total():
        words += f"; {lost} messages lost while the daemon was away"
    return words


def topics(
    routes: Routes, outgoing: Outgoing, incoming: Incoming, services: Services
) -> list[dict[str, Any]]:
    """What becomes of each topic and of calls, for /link/topics."""
    taker = outgoing.taker
    told = [
        {
            "topic": name, "type": route.offer.kind, "direction": "out", "robot": route.robot,
            "state": outgoing.refused.get(name)
            or ("sent" if name in taker.taps else "not wanted by anybody"),
            "sent": taker.sent[name], "lost": taker.lost[name], "refused": taker.refused[name],
        }
        for name, route in routes.taken.items()
    ]  # fmt: skip
    told += [
        {
            "topic": outlet.names[0], "type": outlet.kind.name, "direction": "in",
            "robot": outlet.source.robot,
            "state": "wanted" if bus in incoming.wanted else "no subscriber here",
            "published": incoming.published[bus], "sealed": outlet.is_sealed,
        }
        for bus, outlet in incoming.outlets.items()
    ]  # fmt: skip
    for reasons in (routes.left_out, routes.refused, incoming.refused):
        told += [
            {"topic": name, "direction": "none", "state": reason}
            for name, reason in reasons.items()
        ]
    # Another thread counts on.
    told += [
        {"topic": "", "direction": "in", "state": reason, "dropped": n}
        for reason, n in dict(incoming.dropped).items()
    ]
    told += [
        {"topic": "", "direction": "call", "state": reason, "calls": n}
        for reason, n in dict(services.counts).items()
    ]
    return told
