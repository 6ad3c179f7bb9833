"""What each class is given."""

from typing import Annotated

import msgspec
from msgspec import Meta

from sdrlinkd.link.qos import Qos

Share = Annotated[float, Meta(ge=0, le=0.3)]
Seconds = Annotated[float, Meta(ge=0, le=1)]


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


class ClassesParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """By class."""

    urgent: ClassParams = ClassParams()
    latency: ClassParams = ClassParams(share=0.1)
    default: ClassParams = ClassParams(share=0.05)
    bulk: ClassParams = ClassParams(share=0.05)

    def of(self, qos: Qos) -> ClassParams:
        """That of a class."""
        params: ClassParams = getattr(self, qos.label)
        return params
