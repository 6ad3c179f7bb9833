"""Settings of sealing; their defaults, ranges and meanings are defined only here."""

from typing import Annotated, Literal

import msgspec
from msgspec import Meta


class SecurityParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Sealed PDUs: who holds the team's key can send, and nobody else."""

    mode: Literal["off", "auth", "seal"] = "off"
    """off: everything is in the clear; auth: everyone can read, only the team can send; seal: only
    the team can read and send. The same at all robots."""
    keys: str = "keys.toml"
    """File with the keys, relative to the configuration file; only its owner may read it. A systemd
    credential named `sdrlinkd.keys` comes first."""
    state_dir: str = ""
    """Directory for what must survive a restart; empty: systemd's or the user's state directory."""
    clear: Literal["refuse", "accept"] = "refuse"
    """What happens to PDUs in the clear from robots that were never heard to seal."""
    unproven: Literal["drop", "deliver"] = "drop"
    """Messages of robots that have not proven yet that they are alive now; a station that only
    receives needs `deliver`, and then hears recordings, too."""
    late_s: Annotated[float, Meta(ge=0.13, le=2)] = 0.13
    """Longest delay in s by an attacker that may stay undetected; slow schedules with relays need
    more."""
