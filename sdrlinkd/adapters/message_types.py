"""What the daemon must know of message types: stop messages, and which begin with a header."""

from collections.abc import Mapping

from sdrlinkd.adapters.fields import cdr_from_fields
from sdrlinkd.adapters.stops import begins_with_header, stop_messages
from sdrlinkd.adapters.typestore import knows, ros2_types
from sdrlinkd.config import Setup
from sdrlinkd.errors import UserError, did_you_mean
from sdrlinkd.link import HeardTopic

MOST_TYPES = 1000
"""Types to be remembered, as their names come from the air."""


def unknown_types(setup: Setup) -> list[str]:
    """A warning for each topic whose type is not in its package, although the package is known."""
    names = ros2_types().fielddefs.keys()
    packages = {name.split("/")[0] for name in names}
    found = []
    for topic in setup.registry.topics:
        if topic.type in names or topic.type.split("/")[0] not in packages:
            continue
        hint = did_you_mean(topic.type, names)
        found.append(f"{topic.name}: the type {topic.type} is unknown{hint}")
    return found


class MessageTypes:
    """Facts about the types of the registry's topics, and of those that other robots declare.

    Raises ConfigError if the stop message of a topic of the registry cannot be made.
    """

    def __init__(self, setup: Setup) -> None:
        self._stops: Mapping[int, bytes] = stop_messages(setup)
        self._table = setup.table
        self._headers: dict[str, bool] = {}
        # The first message would otherwise wait for this, and with it the whole event loop.
        ros2_types()

    def has_header(self, kind: str) -> bool:
        """Whether messages of type `kind` begin with a std_msgs/Header; False if unknown."""
        found = self._headers.get(kind)
        if found is None:
            if len(self._headers) >= MOST_TYPES:
                self._headers.clear()
            found = self._headers[kind] = knows(kind) and begins_with_header(kind)
        return found

    def stop(self, topic: HeardTopic) -> bytes | None:
        """The stop message of a topic as CDR; None if its type is unknown, or lacks a field."""
        if topic.about is None:
            return self._stops.get(topic.base)
        policy = self._table.of(topic.at_origin, topic.type, is_command=True)
        try:
            return cdr_from_fields(topic.type, policy.stop, topic.name)
        except UserError:
            return None
