"""A topic that nodes of this robot publish."""

from typing import NamedTuple


class Offer(NamedTuple):
    """A topic that nodes of this robot publish, other than the bridge.

    `is_reliable`: every publisher offers that, and so for `is_latched` (transient local). `hash` is
    the type's RIHS01 hash, empty where ROS does not tell it (Humble). `kinds` are its types.
    `depth` is the largest of its publishers, 0 where one is unknown, as with Fast DDS.
    """

    name: str
    kinds: tuple[str, ...]
    hash: str
    is_reliable: bool
    is_latched: bool
    n_publishers: int
    depth: int
    nodes: tuple[str, ...]

    @property
    def kind(self) -> str:
        """Its type."""
        return self.kinds[0]
