"""The table that `list` shows."""

from collections.abc import Sequence

from rich.text import Text

from sdrlinkd.cli.screens.figures import duration
from sdrlinkd.cli.screens.rows import LEVEL_STYLES
from sdrlinkd.reports import Snapshot
from sdrlinkd.tables import NOTHING, FittedTable, figure, words


def daemons_table(found: Sequence[tuple[str, int | None, Snapshot | str]]) -> FittedTable:
    """A table with a row per daemon: (runtime directory, process id, snapshot or problem)."""
    table = FittedTable(
        "",
        (
            figure("robot"), words("namespace", 4), words("verdict", least=9), words("radio", 3, 9),
            figure("up"), words("runtime directory", least=20), figure("pid", 2),
        ),
    )  # fmt: skip
    for directory, pid, at in found:
        process = NOTHING if pid is None else str(pid)
        if isinstance(at, str):
            table.add(NOTHING, NOTHING, at, NOTHING, NOTHING, directory, process)
            continue
        level = at.verdict.level
        table.add(
            str(at.node),
            at.namespace or NOTHING,
            Text(level, style=LEVEL_STYLES.get(level, "bold")),
            f"{at.carrier.kind} {at.carrier.state}",
            duration(at.uptime_s),
            directory,
            process,
        )
    return table
