"""Makes the files of a team from a few answers."""

from pathlib import Path
from typing import NamedTuple

import tomli_w

from sdrlinkd.init.choosing import FoundTopic
from sdrlinkd.init.radios import RadioPreset

REGISTRY, KEYS = "registry.csv", "keys.toml"
PDU_SIZE = 1100
SLOWEST_MCS = 1
_LISTED = "sdrlinkctl phy info lists them"


class Team(NamedTuple):
    """A person's answers about a team, whose robots are numbered 1 to `robots`."""

    radio: RadioPreset
    robots: int
    frequency: str
    """Centre frequency as text with its unit; empty without a physical radio."""
    device: str
    """The value of soapy.device; empty: the preset's."""
    topics: list[FoundTopic]
    air: Path
    """Folder of the hub's sockets, for a simulated air."""
    sockets: Path
    """Folder of the daemons' sockets, where several run on one computer."""
    hub: str = ""
    """HOST:PORT of a hub that robots on other computers reach; empty: all are on this one."""
    is_sealed: bool = False
    """Whether the team seals its PDUs."""


def team_files(team: Team, ids: list[int]) -> dict[str, str]:
    """The team's files, text by name: the registry, and a configuration for each of `ids`."""
    names = {number: f"robot_{number}.toml" for number in ids}
    if len(ids) == 1:
        names = {ids[0]: "sdrlinkd.toml"}
    return {
        REGISTRY: _registry(team.topics),
        **{name: _config(team, number, len(ids) > 1) for number, name in names.items()},
    }


def _registry(topics: list[FoundTopic]) -> str:
    lines = "".join(f"{topic.name},{topic.type}\n" for topic in topics)
    return (
        "# Topic registry: one `name,type` per line; its position, from 0, is the topic id.\n"
        "# Every robot of the team needs this same file. At most 15 topics.\n" + lines
    )


def _config(team: Team, number: int, has_neighbors: bool) -> str:
    radio, name = team.radio, f"robot_{number}"
    parts = [_head(team, number)]
    told = "a message of 1 KB fits with its age, also sealed; the same at all robots"
    parts.append("[link]\n" + _line(f"pdu_size = {PDU_SIZE}", told))
    if radio.backend != "direct":
        parts.append(_modem(team))
    if radio.is_real:
        parts.append(
            "[soapy]\n"
            + _text("device", team.device or radio.device, "sdrlinkctl radio probe shows it")
            + _line("tx_enabled = false", "nothing is transmitted until you set this to true")
            + "".join(_line(*each) for each in radio.soapy)
        )
    if radio.backend == "ether":
        parts.append("[ether]\n" + _hub(team))
    if radio.shares_air and team.robots > 1:
        parts.append(_rate())
        parts.append(_access(team))
    if team.is_sealed:
        parts.append(
            "[security]\n"
            + _line('mode = "seal"', "only who has the team's key can send or read")
            + _line(f'keys = "{KEYS}"', "installed by sdrlinkctl key install")
        )
    if has_neighbors and not radio.is_real and not team.hub:
        parts.append("[bus]\n" + _text("runtime_dir", str(team.sockets / name)))
    return "\n".join(parts)


def _hub(team: Team) -> str:
    if team.hub:
        return _text("hub", team.hub, "sdrlink-ether --listen serves it")
    return _text("dir", str(team.air), "sdrlink-ether --dir serves it")


def _head(team: Team, number: int) -> str:
    return (
        f"# Robot {number} of {team.robots}, written by `sdrlinkctl init`. All keys and their "
        "meaning:\n# etc/sdrlinkd.toml in the source; installed: share/sdrlinkd/sdrlinkd.toml.\n"
        + _line(f'namespace = "robot_{number}"', f"its topics: /robot_{number}/…")
        + _line(f'registry = "{REGISTRY}"', "the same file at all robots")
        + _line(f'backend = "{team.radio.backend}"')
    )


def _modem(team: Team) -> str:
    radio = team.radio
    lines = [_line(f'rate_hz = "{radio.rate}"', "the channel's width; the same at all robots")]
    if radio.oversampling > 1:
        told = "the radio runs at this multiple of that rate"
        lines.append(_line(f"oversampling = {radio.oversampling}", told))
    if radio.is_real:
        lines.append(_text("frequency_hz", team.frequency, "one that antenna and licence cover"))
    if radio.shares_air and team.robots > 1:
        told = f"QPSK 1/2, without rate.adapt; {_LISTED}"
    else:
        told = f"QPSK 1/2; {_LISTED}"
    lines.append(_line(f"mcs = {SLOWEST_MCS}", told))
    if radio.backend == "ether":
        told = "robots in simulated time notice each other's bursts this soon"
        lines.append(_line('block_s = "0.25 ms"', told))
    return "[modem]\n" + "".join(lines)


def _rate() -> str:
    return "[rate]\n" + "".join((
        _line("adapt = true", "the fastest MCS that all who are to hear a burst can read"),
        _line(f"min_mcs = {SLOWEST_MCS}", "0 reaches further, and makes every turn longer"),
    ))  # fmt: skip


def _access(team: Team) -> str:
    nodes = ", ".join(str(number) for number in range(1, team.robots + 1))
    lines = [
        _line('policy = "auto"', "best policy for the radio; the same at all robots"),
        _line(f"nodes = [{nodes}]"),
    ]
    if team.radio.slot:
        told = "long enough for the turnaround of this radio"
        lines += [_line(f'slot_s = "{team.radio.slot}"', told), _line("reuse = false")]
    return "[access]\n" + "".join(lines)


def _text(key: str, value: str, comment: str = "") -> str:
    """A line that assigns text from a person, quoted for TOML."""
    return _line(tomli_w.dumps({key: value}).rstrip("\n"), comment)


def _line(assignment: str, comment: str = "") -> str:
    return f"{assignment:<27} # {comment}\n" if comment else f"{assignment}\n"
