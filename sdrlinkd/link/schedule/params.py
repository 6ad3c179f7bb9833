"""What each class is given."""

from typing import Annotated

import msgspec
from msgspec import Meta

from sdrlinkd.link.qos import Qos

Share = Annotated[float, Meta(ge=0, le=0.3)]
Seconds = Annotated[float, Meta(ge=0, le=1)]
Lifespan = Annotated[float, Meta(gt=0)]


class ClassParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """How one class shares the air with the others."""

    share: Share = 0.0
    """Of the time on the air, whatever the more urgent classes want."""
    max_burst_s: Seconds = 0.0
    """Longest burst while something more urgent may come that nobody can foresee; 0: that of the
    modem."""
    parity: Annotated[float, Meta(ge=0, le=1)] = 0.0
    """Fragments of parity for each one of a large message: so large a share of its PDUs may be
    lost."""
    lifespan_s: Lifespan = float("inf")
    """Seconds after which a message is not sent any more, where neither it nor its topic says."""


class UrgentParams(ClassParams, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What must come now or not at all."""

    lifespan_s: Lifespan = 1.0


class LatencyParams(ClassParams, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What is worth little when it is old."""

    share: Share = 0.1
    lifespan_s: Lifespan = 2.0


class DefaultParams(ClassParams, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The class of messages that name none."""

    share: Share = 0.05


class BulkParams(ClassParams, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The class of messages that may fill the air."""

    share: Share = 0.05


class ClassesParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What every class is given."""

    urgent: UrgentParams = UrgentParams()
    latency: LatencyParams = LatencyParams()
    default: DefaultParams = DefaultParams()
    bulk: BulkParams = BulkParams()

    def of(self, qos: Qos) -> ClassParams:
        """What one class is given."""
        params: ClassParams = getattr(self, qos.label)
        return params
