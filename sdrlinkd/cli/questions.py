"""Questions with a default, for settings missing on the command line."""

import sys
from collections.abc import Callable
from difflib import get_close_matches
from typing import TypeVar

import typer

from sdrlinkd.errors import UserError
from sdrlinkd.init import RADIOS, RadioPreset
from sdrlinkd.units import hertz

T = TypeVar("T")

TOPICS = "scan:sensor_msgs/msg/LaserScan odom:nav_msgs/msg/Odometry cmd_vel:geometry_msgs/msg/Twist"


class Questions:
    """Asks on a terminal; without one, a missing setting is an error that names the option."""

    def __init__(self) -> None:
        self._can_ask = sys.stdin.isatty()

    def radio(self, given: str) -> RadioPreset:
        """The radio to write for, as given or as answered."""
        if not given and self._can_ask:
            for name, preset in RADIOS.items():
                typer.echo(f"  {name:<9} {preset.title}")
        return self._answer("--radio", "which radio", "hackrf", given, _radio)

    def robots(self, given: int | None) -> int:
        """The number of robots that share the air, as given or as answered."""
        text = "" if given is None else str(given)
        return self._answer("--robots", "how many robots share the channel", "2", text, _count)

    def frequency(self, given: str) -> str:
        """The centre frequency with its unit, as given or as answered."""
        return self._answer("--frequency", _BAND, "433.92 MHz", given, _frequency)

    def device(self, given: str, preset: RadioPreset) -> str:
        """The value of soapy.device; asked only if the preset has none."""
        if not given and preset.device:
            return ""
        return self._answer("--device", "which device", "", given, _device)

    def own_ids(self, given: str, robots: int) -> list[int]:
        """Ids of the robots to write for; not asked if there is only one."""
        if not given and robots == 1:
            return [1]
        return self._answer(
            "--id", f"which robot is this, 1 to {robots}, or all", "1", given,
            lambda text: _ids(text, robots),
        )  # fmt: skip

    def is_sealed(self, given: bool | None) -> bool:
        """Whether the team seals its PDUs, as given or as answered; without a terminal, no."""
        if given is not None or not self._can_ask:
            return bool(given)
        return typer.confirm(
            "seal the link, so that only your team can send and read", default=True
        )

    def topics(self) -> list[str]:
        """The topics as answered: NAME:TYPE each, or the path of a bag, or `graph`."""
        what = "which topics: NAME:TYPE NAME:TYPE …, the path of a bag, or graph (ROS 2, running)"
        return self._answer("--topic", what, TOPICS, "", str.split)

    def _answer(
        self, option: str, question: str, default: str, given: str, read: Callable[[str], T]
    ) -> T:
        if given or not self._can_ask:
            if not given:
                raise UserError(
                    f"{option}: not given, and no terminal to ask on; {question}?"
                    + (f" such as {default}" if default else "")
                )
            return read(given)
        while True:
            try:
                return read(typer.prompt(question, default=default or None))
            except UserError as error:
                typer.echo(str(error), err=True)


_BAND = "which frequency (one that your antenna and licence cover)"


def _radio(text: str) -> RadioPreset:
    preset = RADIOS.get(text)
    if preset is None:
        close = get_close_matches(text, RADIOS, n=1)
        hint = f"; did you mean {close[0]}?" if close else ""
        raise UserError(f'--radio: got "{text}"; allowed: {", ".join(RADIOS)}{hint}')
    return preset


def _count(text: str) -> int:
    if not (text.isdecimal() and 1 <= int(text) <= 254):
        raise UserError(f'--robots: got "{text}"; allowed: a whole number from 1 to 254')
    return int(text)


def _frequency(text: str) -> str:
    value = hertz(text, "--frequency")
    if not 1e5 <= value <= 1e11:
        raise UserError(
            f"--frequency: got {text}; allowed: with its unit, 100 kHz to 100 GHz, such as 2.4 GHz"
        )
    return text


def _device(text: str) -> str:
    if "=" not in text:
        raise UserError(f'--device: got "{text}"; allowed: KEY=VALUE, such as "driver=hackrf"')
    return text


def _ids(text: str, robots: int) -> list[int]:
    if text == "all":
        return list(range(1, robots + 1))
    if not (text.isdecimal() and 1 <= int(text) <= robots):
        raise UserError(f'--id: got "{text}"; allowed: 1 to {robots}, or all')
    return [int(text)]
