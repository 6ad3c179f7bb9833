"""Scenarios with changes from the command line, for `lab` and the hub."""

import math
from enum import StrEnum
from pathlib import Path

import msgspec

from sdrlinkd.errors import UserError
from sdrlinkd.lab import Scenario, load_scenario, shipped_scenarios

MAX_SEED = (1 << 31) - 1


class Pace(StrEnum):
    """How time passes on a simulated air."""

    REALTIME = "realtime"
    LOCKSTEP = "lockstep"


def chosen_scenario(
    path: Path, seed: int | None, duration_s: float | None, pace: Pace | None
) -> Scenario:
    """The scenario in `path`, with the given values in place of its own. Raises UserError."""
    if duration_s is not None and not math.isfinite(duration_s):
        raise UserError(f"--duration: got {duration_s}; allowed: a number of seconds")
    changes = {"seed": seed, "duration_s": duration_s, "pace": pace.value if pace else None}
    given = {key: value for key, value in changes.items() if value is not None}
    return msgspec.structs.replace(load_scenario(path), **given)


def scenario_names(incomplete: str) -> list[str]:
    """Completions for a scenario: shipped ones by name, and files."""
    files = [
        f"{path}/" if path.is_dir() else str(path)
        for path in sorted(Path().glob(f"{incomplete}*") if not incomplete.startswith("/") else ())
        if path.is_dir() or path.suffix == ".toml"
    ]
    return [*(name for name in shipped_scenarios() if name.startswith(incomplete)), *files]
