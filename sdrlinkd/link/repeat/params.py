"""Settings of selective repeat."""

from typing import Annotated

import msgspec
from msgspec import Meta


class RepeatParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """How PDUs that a robot lacks are asked for, and sent again."""

    share: Annotated[float, Meta(ge=0, le=0.5)] = 0.05
    """Share of airtime for PDUs that are sent again because others lack them, all robots together;
    0: none are sent again, and none are asked for."""
