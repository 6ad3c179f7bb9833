"""Which topics go over the radio, and how those of others appear."""

from typing import NamedTuple

COMMANDS = ("cmd_vel", "goal_pose", "initialpose")


class Settings(NamedTuple):
    """The values of the bridge's parameters; see `parameters` for what each means."""

    allow: tuple[str, ...] = ("/*",)
    deny: tuple[str, ...] = ()
    commands: tuple[str, ...] = COMMANDS
    eager: tuple[str, ...] = ()
    rates: tuple[str, ...] = ()
    restamp: tuple[str, ...] = ()
    rx_format: str = "/robot_{src}"
    tf_merge: bool = False
    services_allow: tuple[str, ...] = ()
    services_timeout_s: float = 0.0
