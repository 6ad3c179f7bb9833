"""Options that two commands share."""

from enum import StrEnum

MAX_SEED = (1 << 31) - 1


class Pace(StrEnum):
    """How time goes on on a simulated air."""

    REALTIME = "realtime"
    LOCKSTEP = "lockstep"
