"""The commands of sdrlinkctl, with their help lines and modules."""

from typing import NamedTuple


class Listed(NamedTuple):
    """A command as the help shows it, before its modules are loaded."""

    help: str
    modules: tuple[str, ...]
    """Modules of this package that define the command."""


COMMANDS = {
    "status": Listed(
        "Show the link's verdict and its reasons on one screen; the exit code is the verdict, too.",
        ("status",),
    ),
    "top": Listed(
        "Live view: verdict, neighbors, topics, the last minutes; explains and sets policies.",
        ("top",),
    ),
    "list": Listed("List the daemons of this host.", ("listing",)),
    "init": Listed("Write a first configuration and registry.", ("init",)),
    "key": Listed("Keys of a team, which seal its PDUs.", ("key",)),
    "doctor": Listed(
        "Check machine, environment, radio, permissions and clock, and say what to fix.",
        ("doctor",),
    ),
    "topics": Listed(
        "List topics of the registry, and those received from other robots.",
        ("topics", "dictionary"),
    ),
    "topic": Listed("Rate, bandwidth and delay of a received topic.", ("topic",)),
    "latency": Listed(
        "Show the latency of each received topic, its causes, and the clocks of the neighbors.",
        ("latency",),
    ),
    "routes": Listed(
        "Show who hears whom in the team, and who forwards what goes through this robot.",
        ("routes",),
    ),
    "web": Listed("Serve a page with map, link and topics until Ctrl-C.", ("web",)),
    "exporter": Listed(
        "Serve the figures of this host's daemons to Prometheus until Ctrl-C.", ("exporter",)
    ),
    "bridge": Listed("Show the link and what it carries in other programs.", ("bridge",)),
    "log": Listed(
        "Keep reports, events and messages of daemons in one file until Ctrl-C.", ("drive",)
    ),
    "report": Listed(
        "Make one HTML page of a drive: map, delivery, latency, drops, events, what to change.",
        ("drive",),
    ),
    "check": Listed(
        "Verify the running daemon's ledger; exit code 1 when it does not add up.", ("status",)
    ),
    "why": Listed("Explain in plain words what happens to a topic.", ("policy",)),
    "set": Listed(
        "Change a topic's policy until the next restart or reload; prints old and new values.",
        ("policy",),
    ),
    "reload": Listed("Make the daemon re-read its topic policies.", ("status",)),
    "pub": Listed("Publish a message to the daemon.", ("messages",)),
    "echo": Listed("Show messages received from other robots.", ("messages",)),
    "bag": Listed("Recordings of messages.", ("bag", "bag_play", "bag_record")),
    "plan": Listed(
        "Plan airtime and worst-case latency by topic; exit code 1 when the traffic does not fit.",
        ("plan",),
    ),
    "pdu": Listed("PDUs on the air.", ("pdu",)),
    "phy": Listed("The modem, and recordings of samples.", ("phy", "phy_compile", "wifi")),
    "radio": Listed("Radios of this machine, through SoapySDR.", ("radio",)),
    "record": Listed("Record what a radio hears, without a daemon; never transmits.", ("record",)),
    "replay": Listed(
        "Transmit a recording without a daemon, each burst at its recorded time.", ("replay",)
    ),
    "demo": Listed(
        "Send a robot's messages through daemons and radios; repeat the paper's measurements.",
        ("demo",),
    ),
    "lab": Listed(
        "Run several robots' daemons on one simulated channel; measure the delivery of each pair.",
        ("lab",),
    ),
    "bench": Listed(
        "Run a benchmark, such as `bench pound --quick`; further options are the benchmark's own.",
        ("bench",),
    ),
    "help": Listed(
        "Show a how-to page, a word's meaning, a configuration key, a ledger name or a command.",
        ("help",),
    ),
}
"""All commands by name, in the order of the help."""
