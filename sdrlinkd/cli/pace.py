"""An option that two commands share."""

from enum import StrEnum


class Pace(StrEnum):
    """How time goes on on a simulated air."""

    REALTIME = "realtime"
    LOCKSTEP = "lockstep"
