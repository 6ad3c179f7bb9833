"""What a policy that gives turns by request has in addition to others (`grant`)."""

from typing import Protocol

from sdrlinkd.link.access.requests import Waiting
from sdrlinkd.link.paths import Edges
from sdrlinkd.wire import Grant, Record, Want


class ByRequest(Protocol):
    """Turns by request: robots tell what waits, and one of them plans who gets the air for it."""

    @property
    def round_s(self) -> float:
        """The longest round in s."""

    @property
    def plans(self) -> bool:
        """Whether this robot plans turns for the team now."""

    @property
    def is_far(self) -> bool:
        """Whether the robot that plans does not hear us."""

    @property
    def ahead_s(self) -> float:
        """How far ahead, in s, requests cover what will wait."""

    @property
    def patience_s(self) -> float:
        """Time in s for which what is not urgent gives way to urgent messages that are expected."""

    @property
    def tells_at(self) -> float:
        """Time in s from which the policy itself has something to tell; infinity: nothing."""

    @property
    def must_tell(self) -> bool:
        """Whether our next burst must tell something."""

    def turn_at(self, earliest: float) -> float:
        """When we may send next, at `earliest` or later, as far as known; infinity: unknown."""

    def request(self, start: float, left: Waiting | None) -> Want | None:
        """What a burst at `start` should ask for, after which `left` waits; None: nothing."""

    def requested(self, want: Want, start: float) -> None:
        """Note that a burst at `start` asks for something."""

    def told(self, start: float, length_s: float, room: int) -> list[Record]:
        """What a burst of `length_s` at `start` must tell, in a PDU with `room` octets for it."""

    def take_want(self, want: Want, at: float) -> None:
        """Take what a robot wants to send, as told directly in a burst at `at`."""

    def take_grant(self, src: int, grant: Grant, at: float, *, is_weak: bool = False) -> None:
        """Take the turns that robot `src` told, after a FRAME, in a burst at `at`.

        `is_weak`: the signal was weaker than PDUs need.
        """

    def hardly_heard(self, by: int, node: int, at: float) -> None:
        """Note that robot `by`, we or another one, hears a PDU of robot `node` directly at times,
        as the signal is weaker than PDUs need.
        """

    def know_links(self, edges: Edges) -> None:
        """Take the links of the team."""
