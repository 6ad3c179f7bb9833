"""Prints figures on the structure of the code."""

from rich.console import Console

from benchmarks.structure.sources import deep_chains, graph, writes
from benchmarks.structure.trace import Step, trace
from sdrlinkd.tables import FittedTable, figure, screen_console, words

ROOMS = ("sdrlinkd", "sdrlinkd.link", "sdrlinkd.bus", "backends", "backends.soapy", "phy")


def main() -> None:
    """Print the figures as tables for people."""
    console = screen_console()
    for with_beacon, beside in ((False, "between two beacons"), (True, "with a beacon in its PDU")):
        _print_trace(console, trace(with_beacon), f"one message of 724 B, {beside}")
    table = FittedTable(
        "imports between the packages directly inside a package",
        (words("room", least=16), figure("rooms"), figure("arrows"), figure("floors"),
         figure("upward")),
    )  # fmt: skip
    for room in ROOMS:
        found = graph(room)
        table.add(
            room, str(len(found.rooms)), str(len(found.arrows)), str(found.floors),
            str(len(found.upward)),
        )  # fmt: skip
    console.print(table)
    written = writes("sdrlinkd.link", "Outgoing")
    console.print(
        f"fields named like a queued message's are set elsewhere in {len(written)} files: "
        f"{dict(written)}"
    )
    chains, lines = deep_chains("sdrlinkd.link")
    console.print(
        f"deep chains in sdrlinkd.link: {chains} in {lines} lines, {1000 * chains / lines:.1f} "
        "per 1000"
    )


def _print_trace(console: Console, steps: list[Step], title: str) -> None:
    table = FittedTable(
        title,
        (words("step", least=12), figure("calls"), figure("files"), figure("changes of file")),
    )
    for step in steps:
        table.add(step.name, str(len(step.files)), str(len(set(step.files))), str(step.changes))
    table.add(
        "all",
        str(sum(len(step.files) for step in steps)),
        str(len({file for step in steps for file in step.files})),
        str(sum(step.changes for step in steps)),
    )
    console.print(table)


if __name__ == "__main__":
    main()
