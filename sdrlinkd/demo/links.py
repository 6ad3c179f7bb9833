"""Writes the configurations of a run: one node, or one that records and one that plays."""

from dataclasses import dataclass
from pathlib import Path

from sdrlinkd.demo.source import Source

NODE_ID = 1
LISTENER_ID = 2
MAX_CFO_HZ = 1e5
LONGEST_PAUSE_S = 3.0
N_ENTRY_IDS = 256
SHARE_AT_REST = 0.6
"""Reassembly timeout as a share of the time in which a topic uses all its entry ids; an id rests
for 1.25 timeouts."""


@dataclass(frozen=True, kw_only=True)
class Options:
    """Options of a run; those from `mcs` on apply only to the links `ofdm` and `iqfile`."""

    link: str
    pdu_size: int = 64
    speed: float = 1.0
    seed: int = 1
    mcs: int = 1
    snr_db: float = 15.0
    clock_ppm: float = 10.0
    channel: str = "awgn"
    rate_hz: float = 5e6
    engine: str = "auto"
    recording: Path | None = None
    """Path where `iqfile` keeps its recording; None: it is not kept."""


def write_config(
    directory: Path, source: Source, options: Options, role: str, recording: Path
) -> Path:
    """Write the configuration of a node with sockets in `directory`; returns the file's path.

    `role` is "both" for a node that hears itself, and "record" or "play" for the two nodes of a
    recording.
    """
    directory.mkdir(exist_ok=True)
    (directory / "registry.csv").write_text(source.registry.csv())
    # A long timeout avoids losses when the machine stalls. But entry ids rest for that time, so it
    # is limited by the time in which a topic uses all its ids.
    ids_last_s = N_ENTRY_IDS / (source.fastest_hz * options.speed)
    timeout_s = max(0.02, min(LONGEST_PAUSE_S, SHARE_AT_REST * ids_last_s))
    backend = {"direct": "direct", "ofdm": "loopback", "iqfile": "iqfile"}[options.link]
    node = LISTENER_ID if role == "play" else NODE_ID
    lines = [
        f'namespace = "{source.namespace}"',
        f"robot_id = {node}",
        f"seed = {options.seed}",
        "rx_depth = 0",
        f'backend = "{backend}"',
        "[link]",
        f"pdu_size = {options.pdu_size}",
        *(["beacon_s = 0"] if role == "play" else []),
        "[reassembly]",
        f"timeout_s = {timeout_s}",
        "[bus]",
        f'runtime_dir = "{directory}"',
    ]
    if options.link != "direct":
        lines += [
            "[modem]",
            f"rate_hz = {options.rate_hz}",
            f"mcs = {options.mcs}",
            f'engine = "{options.engine}"',
            f"max_cfo_hz = {min(MAX_CFO_HZ, options.rate_hz / 4)}",
            "[channel]",
            f'profile = "{options.channel}"',
            f"snr_db = {options.snr_db}",
            f"clock_ppm = {options.clock_ppm}",
        ]
    if options.link == "iqfile":
        lines += ["[iqfile]", 'format = "ci8"']
        if role == "record":
            lines += [f"transmit = '{recording}'"]
        else:
            lines += [f"receive = '{recording}'", "paced = false", "wait_for_consumer = true"]
    # As in the paper each message counts, and a machine that stalls must not replace any.
    lines.append("[topic]")
    lines += [f"{topic.name!r}.offer = false" for topic in source.registry.topics]
    path = directory / "sdrlinkd.toml"
    path.write_text("\n".join(lines) + "\n")
    return path
