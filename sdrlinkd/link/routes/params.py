"""Settings of relays."""

from typing import Annotated, Literal

import msgspec
from msgspec import Meta


class RelayParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Settings of relays, which forward PDUs between robots that do not hear each other."""

    policy: Literal["none", "routes", "flood", "auto"] = "none"
    """What is relayed; routes: what `routes` names; flood: every PDU until its hops are used up;
    auto: what the team needs, by routes that it finds itself."""
    routes: list[str] = []
    """Routes as "FROM>TO", by robot id: "1>3", "any>3", "1>all" (broadcasts), "any>any"."""
    lifespan_s: Annotated[float, Meta(gt=0, le=10)] = 1.0
    """Longest wait in s of a PDU to be relayed. Keep it below the time after which a topic reuses
    an entry id."""
