"""What a kind of radio is to those above it: a row of the registry."""

import importlib
from collections.abc import Callable
from functools import reduce
from typing import TYPE_CHECKING, Any, NamedTuple

import msgspec

from backends.base import BackendError, Capabilities, Patience, Radio

if TYPE_CHECKING:
    from backends.air import Channel


class ModemNeeds(NamedTuple):
    """What the modem asks of any radio."""

    rate_hz: float
    """Samples a second in the modem, and the width of the channel."""
    oversampling: int
    """The radio runs at so many times that rate."""
    frequency_hz: float
    """Middle of the channel; 0: not set."""
    block_s: float
    """Samples are wanted in pieces of this length."""

    @property
    def radio_rate_hz(self) -> float:
        """Samples a second at the radio."""
        return self.rate_hz * self.oversampling


class RadioRequest(NamedTuple):
    """What a radio is made from, besides its own settings."""

    needs: ModemNeeds
    node_id: int
    longest_s: float
    """No burst that it is given is longer."""
    patience: Patience
    """What it does when it is opened and is not there."""
    make_channel: "Callable[[], Channel]"
    """The simulated air of the configuration, for radios without one of their own."""


class Presumption(NamedTuple):
    """What a radio should be able to do, before it is open."""

    capabilities: Capabilities
    told: str
    """What of that only the radio can tell, in words; empty: nothing."""
    is_sure: bool
    """Whether the radio, once it is open, will be like that."""


def no_problem(_settings: Any, _needs: ModemNeeds) -> str:  # noqa: ANN401  # any backend's
    """Find nothing wrong with any settings."""
    return ""


def nothing_unchecked(_settings: Any) -> list[str]:  # noqa: ANN401
    """Leave nothing that only the radio could tell."""
    return []


def presume_full_duplex(
    _settings: Any,  # noqa: ANN401
    needs: ModemNeeds,
    turnaround_s: float | None,
) -> Presumption:
    """Take a radio of which nothing is known for one that sends while it listens, or, with a
    `turnaround_s`, that does not.
    """
    duplex = (
        "sends and receives at once" if turnaround_s is None else "cannot receive while it sends"
    )
    told = f"unknown kind: assumed to be a radio that {duplex} and keeps time"
    return Presumption(simulated(needs, turnaround_s), told, is_sure=False)


def simulated(
    needs: ModemNeeds, turnaround_s: float | None, lead_s: float = 0.0, shares_air: bool = True
) -> Capabilities:
    """A radio that does all at once and exactly; with a `turnaround_s`, a half-duplex one."""
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
    """A kind of radio: its name, its settings, how one is made, and what is known of all of them.

    `make` is loaded when the first one is made, so that a row costs nothing. The daemon heeds two
    keys of any `settings`: with `hear_self` it takes its own PDUs, with `wait_for_consumer` it
    opens the air when the first consumer subscribes.
    """

    name: str
    """The word for the key `backend`, and of its own section."""
    settings: type[msgspec.Struct]
    """Its own section of the configuration; every key has a default."""
    make: str
    """`module:callable` that takes (settings, RadioRequest) and returns a Radio.

    It raises BackendError for what it cannot be made from.
    """
    files: tuple[str, ...] = ()
    """Keys of its settings that name files, relative to the configuration's."""
    is_timed: bool = True
    """Its samples come by the clock: a machine that sleeps, or is too slow, loses some."""
    starts_time: bool = False
    """Time begins with its first sample, as in a recording."""
    may_be_away: bool = True
    """It may not be there, and come; its section may change meanwhile."""
    heeds_patience: bool = False
    """It waits where RadioRequest.patience says so, and notices when it was replugged."""
    problem: Callable[[Any, ModemNeeds], str] = no_problem
    """What is wrong with its settings for that modem: key, given, allowed; empty: nothing."""
    unchecked: Callable[[Any], list[str]] = nothing_unchecked
    """What nobody can know of these settings before the radio is open, one thing each."""
    presume: Callable[[Any, ModemNeeds, float | None], Presumption] = presume_full_duplex
    """What a radio set so should be able to do; with a turnaround in s, another than is set."""

    def radio(self, settings: msgspec.Struct, request: RadioRequest) -> Radio:
        """Make one; it is not open. Raises BackendError."""
        module, _, path = self.make.partition(":")
        try:
            make = reduce(getattr, path.split("."), importlib.import_module(module))
        except Exception as error:
            # What others wrote may fail in any way.
            raise BackendError(
                f'backend: got "{self.name}", whose code cannot be loaded: {self.make} '
                f"({type(error).__name__}: {error}); allowed: another backend, or an intact "
                "package"
            ) from error
        made: Radio = make(settings, request)  # type: ignore[operator]
        return made
