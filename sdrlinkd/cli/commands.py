"""The commands of sdrlinkctl, with their help lines and modules."""

from typing import NamedTuple


class Listed(NamedTuple):
    """A command as the help shows it, before its modules are loaded."""

    help: str
    modules: tuple[str, ...]
    """Modules of this package that define the command."""


COMMANDS = {
    "status": Listed(
        "The verdict in plain words, and one screen of reasons; the exit code is the verdict, too.",
        ("status",),
    ),
    "top": Listed(
        "The link, live: verdict, robots both ways, topics, the last minutes; why and set, too.",
        ("top",),
    ),
    "list": Listed("The daemons of this host.", ("listing",)),
    "init": Listed("Write a configuration and a registry to begin with.", ("init",)),
    "doctor": Listed(
        "Check machine, environment, radio, permissions and clock, and say what to do.",
        ("doctor",),
    ),
    "topics": Listed(
        "Topics of the registry, and those heard from other robots.", ("topics", "dictionary")
    ),
    "topic": Listed("Rate, bandwidth and delay of a topic heard.", ("topic",)),
    "latency": Listed(
        "How late messages come and why, topic by topic; and the clocks of the robots heard.",
        ("latency",),
    ),
    "check": Listed(
        "Verify the running daemon's ledger; exit code 1 when it does not add up.", ("status",)
    ),
    "why": Listed("What happens to a topic, in plain words.", ("policy",)),
    "set": Listed(
        "Change a topic's policy until the next restart or reload; shows what was and what is.",
        ("policy",),
    ),
    "reload": Listed("Have the daemon read its topic policies anew.", ("status",)),
    "pub": Listed("Publish a message to the daemon.", ("messages",)),
    "echo": Listed("Show messages heard from other robots.", ("messages",)),
    "bag": Listed("Recordings of messages.", ("bag",)),
    "plan": Listed(
        "Airtime and worst-case latency by topic; exit code 1 when the air cannot carry it.",
        ("plan",),
    ),
    "pdu": Listed("PDUs on the air.", ("pdu",)),
    "phy": Listed("The modem, and recordings of samples.", ("phy", "wifi")),
    "radio": Listed("Radios of this machine, by SoapySDR.", ("radio",)),
    "record": Listed(
        "Record what a radio hears, without a daemon. Nothing is ever sent.", ("record",)
    ),
    "replay": Listed(
        "Send what is in a recording, without a daemon: each burst at its time.", ("replay",)
    ),
    "demo": Listed(
        "Send a robot's messages through daemons and radios; measure what the paper measured.",
        ("demo",),
    ),
    "lab": Listed(
        "Run several robots' daemons on one simulated air; measure who got what of whom.",
        ("lab",),
    ),
    "bench": Listed(
        "Measure beside peers: `bench pound --quick`; further options are the benchmark's own.",
        ("bench",),
    ),
    "help": Listed(
        "Show a how-to page, a configuration key, a ledger name or a command.", ("help",)
    ),
}
"""All commands by name, in the order of the help."""
