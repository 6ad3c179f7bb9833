"""One kind of radio, as the rest of the daemon sees it: a row of the registry."""

import importlib
from collections.abc import Awaitable, Callable
from functools import reduce
from typing import TYPE_CHECKING, Any, NamedTuple

import msgspec

from backends.base import BackendError, Capabilities, Patience, Radio

if TYPE_CHECKING:
    from backends.air import Channel


class ModemNeeds(NamedTuple):
    """What the modem requires of any radio."""

    rate_hz: float
    """Sample rate of the modem, which is also the width of the channel."""
    oversampling: int
    """The radio's sample rate, as a multiple of `rate_hz`."""
    frequency_hz: float
    """Centre frequency of the channel; 0: not set."""
    block_s: float
    """Length of the blocks in which the modem wants samples."""

    @property
    def radio_rate_hz(self) -> float:
        """Sample rate of the radio."""
        return self.rate_hz * self.oversampling


class RadioRequest(NamedTuple):
    """What a radio is made from, besides its own settings."""

    needs: ModemNeeds
    node_id: int
    longest_s: float
    """Length of the longest burst that the radio is given."""
    patience: Patience
    """What the radio does when its device is absent at opening."""
    make_channel: "Callable[[], Channel]"
    """Makes the configured simulated air, for radios without an air of their own."""
    pid: int
    """The process that people know as the user of this radio: its daemon."""


class Presumption(NamedTuple):
    """What a radio should be able to do, presumed before it is open."""

    capabilities: Capabilities
    told: str
    """What the presumption is based on, in words; empty: nothing to add."""
    is_sure: bool
    """Whether the open radio is certain to match the presumption."""


def no_problem(_settings: Any, _needs: ModemNeeds) -> str:  # noqa: ANN401  # any backend's
    """Report no problem, whatever the settings."""
    return ""


def nothing_unchecked(_settings: Any) -> list[str]:  # noqa: ANN401
    """Report nothing that has to wait for the open radio."""
    return []


async def as_configured(settings: Any, _patience: Patience) -> bool:  # noqa: ANN401
    """Whether `settings` leave the key `paced` as it is, which is set."""
    return bool(getattr(settings, "paced", True))


def presume_full_duplex(
    _settings: Any,  # noqa: ANN401
    needs: ModemNeeds,
    turnaround_s: float | None,
) -> Presumption:
    """Presume that an unknown radio is full duplex, or half-duplex if `turnaround_s` is given."""
    duplex = (
        "sends and receives at once" if turnaround_s is None else "cannot receive while it sends"
    )
    told = f"unknown kind: assumed to be a radio that {duplex} and keeps time"
    return Presumption(simulated(needs, turnaround_s), told, is_sure=False)


def simulated(
    needs: ModemNeeds, turnaround_s: float | None, lead_s: float = 0.0, shares_air: bool = True
) -> Capabilities:
    """Capabilities of a simulated, exact radio; with a `turnaround_s`, a half-duplex one."""
    return Capabilities(
        receives=True,
        transmits=True,
        full_duplex=turnaround_s is None,
        timestamps=True,
        paced=True,
        lead_s=lead_s,
        turnaround_s=turnaround_s or 0.0,
        block_s=needs.block_s,
        shares_air=shares_air,
    )


class Backend(NamedTuple):
    """A kind of radio: its name, its settings, how to make one, and its common properties.

    The module in `make` is imported when the first radio is made, so a row costs nothing. The
    daemon reads three keys of any `settings`: with `hear_self` it accepts its own PDUs, with
    `wait_for_consumer` it opens the air when the first consumer subscribes, and with `paced` set to
    false it takes samples as fast as they come.
    """

    name: str
    """The value of the key `backend`, and the name of the settings' section."""
    settings: type[msgspec.Struct]
    """The radio's own section of the configuration; every key has a default."""
    make: str
    """`module:callable` that takes (settings, RadioRequest) and returns a Radio.

    The callable raises BackendError if the settings cannot be used.
    """
    files: tuple[str, ...] = ()
    """Settings that name files; relative paths start at the configuration file."""
    is_timed: bool = True
    """Samples arrive in real time: a suspended or slow machine loses some."""
    starts_time: bool = False
    """Time begins with the first sample, as in a recording."""
    may_be_away: bool = True
    """The device may be absent and appear later; the radio's section may change meanwhile."""
    heeds_patience: bool = False
    """The radio waits as RadioRequest.patience says, and notices when its device was replugged."""
    is_hardware: bool = True
    """Samples come from a device that does not wait; the modem asks for real-time priority."""
    keeps_pace: Callable[[Any, Patience], Awaitable[bool]] = as_configured
    """Whether samples come in real time, once the radio is open; false: as fast as they are taken.

    It may wait as RadioRequest.patience says. Raises BackendError.
    """
    problem: Callable[[Any, ModemNeeds], str] = no_problem
    """What is wrong with the settings for that modem: key, given, allowed; empty: nothing."""
    unchecked: Callable[[Any], list[str]] = nothing_unchecked
    """What cannot be checked about the settings before the radio is open, one item each."""
    presume: Callable[[Any, ModemNeeds, float | None], Presumption] = presume_full_duplex
    """What a radio with these settings should be able to do; a turnaround in s overrides theirs."""

    def radio(self, settings: msgspec.Struct, request: RadioRequest) -> Radio:
        """Make a radio, not open yet. Raises BackendError."""
        module, _, path = self.make.partition(":")
        try:
            make = reduce(getattr, path.split("."), importlib.import_module(module))
        except Exception as error:
            # Third-party code may fail in any way.
            raise BackendError(
                f'backend: got "{self.name}", whose code cannot be loaded: {self.make} '
                f"({type(error).__name__}: {error}); allowed: another backend, or an intact "
                "package"
            ) from error
        made: Radio = make(settings, request)  # type: ignore[operator]
        return made
