"""Resolves topic names as people type them."""

from sdrlinkd.client import unknown_topic
from sdrlinkd.errors import UserError
from sdrlinkd.reports import Snapshot, TopicReport


def topic_sent(given: str, snapshot: Snapshot) -> TopicReport:
    """This robot's topic with the bus name or registry name `given`.

    Raises UserError if there is none.
    """
    sent = {each.name: each for each in snapshot.link.topics if each.subscribed}
    topic = sent.get(given) or sent.get(_on_bus(given, snapshot))
    if topic is None:
        raise UserError(unknown_topic(given, sent))
    return topic


def refuse_own(given: str, snapshot: Snapshot, rx_format: str) -> None:
    """Raise UserError if this robot itself sends `given`, which is not republished here.

    The error names other robots' topics instead, which appear under `rx_format`.
    """
    own = {each.name for each in snapshot.link.topics}
    name = given if given in own else _on_bus(given, snapshot)
    if given.endswith("*") or name not in own or _republished(given, rx_format):
        return
    short = name.removeprefix(_on_bus("", snapshot))
    heard = _place(rx_format, "N") + "/" + short
    robots = sorted(each.src for each in snapshot.link.neighbors)
    so_far = f"heard so far: {', '.join(map(str, robots))}" if robots else "none heard so far"
    raise UserError(
        f"topic: got {given}, which this robot sends; robot N's appears as {heard} ({so_far})"
    )


def _on_bus(short: str, snapshot: Snapshot) -> str:
    namespace = snapshot.namespace.strip("/")
    return f"/{namespace}/{short.strip('/')}" if namespace else f"/{short.strip('/')}"


def _republished(name: str, rx_format: str) -> bool:
    """Whether another robot's topic may appear under `name`."""
    return any(name.startswith(_place(rx_format, str(robot)) + "/") for robot in range(256))


def _place(rx_format: str, robot: str) -> str:
    return rx_format.replace("{src_id}", robot).replace("{src}", robot).rstrip("/")
