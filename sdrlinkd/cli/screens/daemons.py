"""The table that `list` shows."""

from collections.abc import Sequence

from rich.text import Text

from sdrlinkd.cli.screens.figures import duration
from sdrlinkd.cli.screens.rows import LEVEL_STYLES
from sdrlinkd.reports import Snapshot
from sdrlinkd.tables import NOTHING, FittedTable, figure, words

LEAST, OTHERS = 24, 46
"""Characters of the shortest column of directories, and of the columns beside it."""


def daemons_table(
    found: Sequence[tuple[str, int | None, Snapshot | str]], width: int
) -> FittedTable:
    """A table with a row per daemon: (runtime directory, process id, snapshot or problem).

    Long directories lose their beginning, so that a row takes a line of `width` characters.
    """
    room = max(LEAST, width - OTHERS)
    table = FittedTable(
        "",
        (
            figure("robot"), words("namespace", 4), words("verdict", least=9), words("radio", 3, 9),
            figure("up"), words("runtime directory", least=20), figure("pid", 2),
        ),
    )  # fmt: skip
    for whole, pid, at in found:
        directory = whole if len(whole) <= room else f"…{whole[1 - room :]}"
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
