"""What `lab` and the hub share: a scenario, and what the command line says otherwise."""

import math
from enum import StrEnum
from pathlib import Path

import msgspec

from sdrlinkd.errors import UserError
from sdrlinkd.lab import Scenario, load_scenario

MAX_SEED = (1 << 31) - 1


class Pace(StrEnum):
    """How time goes on on a simulated air."""

    REALTIME = "realtime"
    LOCKSTEP = "lockstep"


def chosen_scenario(
    path: Path, seed: int | None, duration_s: float | None, pace: Pace | None
) -> Scenario:
    """The scenario in `path`, but for what is given. Raises UserError."""
    if duration_s is not None and not math.isfinite(duration_s):
        raise UserError(f"--duration: got {duration_s}; allowed: a number of seconds")
    changes = {"seed": seed, "duration_s": duration_s, "pace": pace.value if pace else None}
    given = {key: value for key, value in changes.items() if value is not None}
    return msgspec.structs.replace(load_scenario(path), **given)
