"""ROS message types: definitions, CDR and defaults, with the rosbags library."""

from functools import cache
from typing import Any

from rosbags.convert.converter import default_message, is_same_wireformat, migrate_bytes
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from sdrlinkd.errors import CdrError, UserError


@cache
def ros2_types() -> Typestore:
    """The message types of ROS 2 Humble."""
    return get_typestore(Stores.ROS2_HUMBLE)


def knows(kind: str) -> bool:
    """Whether the message type `kind` is known."""
    return kind in ros2_types().fielddefs


def definition(kind: str) -> str:
    """The definition of `kind` and of the types in it, as rosbags' text; empty if unknown."""
    return ros2_types().generate_msgdef(kind, ros_version=2)[0] if knows(kind) else ""


def type_hash(kind: str) -> str:
    """The RIHS01 hash of `kind`, as in `RIHS01_…`; empty if unknown."""
    return ros2_types().hash_rihs01(kind) if knows(kind) else ""


def to_cdr(message: object, kind: str) -> bytes:
    """A message of `kind` as CDR bytes."""
    return bytes(ros2_types().serialize_cdr(message, kind))


def from_cdr(data: bytes, kind: str) -> Any:  # noqa: ANN401
    """The message in CDR bytes. Raises CdrError if they are not valid CDR of type `kind`."""
    try:
        return ros2_types().deserialize_cdr(data, kind)
    except Exception as error:  # the library's generated code may raise anything
        raise CdrError(f"not valid CDR of {kind}: {str(error).rstrip('.')}") from None


def empty(kind: str) -> Any:  # noqa: ANN401
    """A message of type `kind` with default fields. Raises UserError if the type is unknown."""
    if not knows(kind):
        raise UserError(
            f"type {kind} is unknown; allowed: ROS 2 types such as nav_msgs/msg/Odometry"
        )
    return default_message(ros2_types(), kind)


class Ros1Converter:
    """Converts ROS 1 messages to ROS 2 CDR, field by field if the definitions differ."""

    def __init__(self, source: Typestore) -> None:
        self._source = source
        self._cache: dict[str, object] = {}

    @classmethod
    def from_definition(cls, kind: str, definition: str) -> "Ros1Converter":
        """A converter for the type whose ROS 1 definition is given as text."""
        store = get_typestore(Stores.ROS1_NOETIC)
        store.register(
            {
                name: fields
                for name, fields in get_types_from_msg(definition, kind).items()
                if name not in store.fielddefs
            }
        )
        return cls(store)

    def convert(self, data: bytes, kind: str) -> bytes:
        """CDR of a ROS 1 message of `kind` (`pkg/msg/Name`)."""
        target = ros2_types()
        if kind not in target.fielddefs:
            text = self._source.generate_msgdef(kind, ros_version=2)[0]
            target.register(
                {
                    name: fields
                    for name, fields in get_types_from_msg(text, kind).items()
                    if name not in target.fielddefs
                }
            )
        if is_same_wireformat(self._source, target, kind, kind):
            return bytes(target.ros1_to_cdr(data, kind))
        return bytes(
            migrate_bytes(
                self._source, target, kind, kind, self._cache, data, src_is2=False, dst_is2=True
            )
        )
