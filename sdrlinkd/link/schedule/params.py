"""Settings of the traffic classes, and of air that is reserved."""

from typing import Annotated

import msgspec
from msgspec import Meta

from sdrlinkd.link.qos import Qos

Share = Annotated[float, Meta(ge=0, le=0.3)]
Seconds = Annotated[float, Meta(ge=0, le=1)]
Lifespan = Annotated[float, Meta(gt=0)]


class ClassParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """How one class shares the airtime with the others."""

    share: Share = 0.0
    """Guaranteed share of this robot's airtime, even if more urgent classes want it."""
    max_burst_s: Seconds = 0.0
    """Longest burst in s of this class while topics of a more urgent class have no period that can
    be predicted; 0: that of the modem."""
    parity: Annotated[float, Meta(ge=0, le=1)] = 0.0
    """Parity fragments per fragment of a large message: the share of its PDUs that may be lost."""
    twice: bool = False
    """Whether messages with a lifespan below 0.1 s, for which a request to repeat them comes too
    late, are sent twice, 5 ms apart. This takes almost three times their airtime."""
    lifespan_s: Lifespan = float("inf")
    """Age in s after which a message is not sent any more, if neither it nor its topic has a
    lifespan."""


class UrgentParams(ClassParams, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The class urgent: messages that must arrive now or not at all."""

    lifespan_s: Lifespan = 1.0


class LatencyParams(ClassParams, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The class latency: messages that lose their value with age."""

    share: Share = 0.1
    lifespan_s: Lifespan = 2.0


class DefaultParams(ClassParams, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The class default: messages without a configured class."""

    share: Share = 0.05


class BulkParams(ClassParams, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The class bulk: messages that may fill the remaining airtime."""

    share: Share = 0.05


class ClassesParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Settings of all traffic classes."""

    urgent: UrgentParams = UrgentParams()
    latency: LatencyParams = LatencyParams()
    default: DefaultParams = DefaultParams()
    bulk: BulkParams = BulkParams()

    def of(self, qos: Qos) -> ClassParams:
        """The settings of one class."""
        params: ClassParams = getattr(self, qos.label)
        return params


class AdmissionParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Air that topics reserve in the whole team (the key `reserve` of a topic)."""

    share: Annotated[float, Meta(ge=0, le=1)] = 0.9
    """Share of the air that the access policy leaves, up to which flows are admitted, all robots
    together; the same at all of them. 0: nothing is reserved."""
