"""Stop messages, which are published when a command topic falls silent."""

from rosbags.interfaces import Nodetype

from sdrlinkd.adapters.fields import cdr_from_fields
from sdrlinkd.adapters.typestore import knows, ros2_types
from sdrlinkd.config import Setup, located
from sdrlinkd.errors import ConfigError, UserError

HEADER = "std_msgs/msg/Header"


def stop_messages(setup: Setup) -> dict[int, bytes]:
    """The stop messages as CDR by topic id, for all topics whose type is known.

    Their fields are those of the policy's `stop`, all others zero. Raises ConfigError if a policy's
    stop message cannot be made.
    """
    try:
        return _made(setup)
    except ConfigError as error:
        raise ConfigError(located(str(error), setup.source)) from None


def _made(setup: Setup) -> dict[int, bytes]:
    made = {}
    for topic in setup.registry.topics:
        policy = setup.table.of(topic.name, topic.type, is_command=True)
        configured = setup.table.configured(topic.name)
        where = f"topic.{topic.name}"
        if not knows(topic.type):
            if configured.deadman_s or configured.stop:
                raise ConfigError(
                    f"{where}.deadman_s: got {configured.deadman_s:g}, but the type "
                    f"{topic.type} is unknown here, so no stop message can be made; allowed: 0"
                )
            continue
        try:
            made[topic.id] = cdr_from_fields(topic.type, policy.stop, f"{where}.stop")
        except UserError as error:
            raise ConfigError(str(error)) from None
    return made


def begins_with_header(kind: str) -> bool:
    """Whether messages of the known type `kind` begin with a std_msgs/Header."""
    fields = ros2_types().fielddefs[kind][1]
    return bool(fields) and fields[0][1] == (Nodetype.NAME, HEADER)
