"""The screen of `status`: the verdict, followed by as much as fits, the worst first."""

from collections.abc import Sequence
from dataclasses import dataclass

from rich.console import Console, ConsoleOptions, RenderableType, RenderResult
from rich.text import Text

from sdrlinkd.cli.screens.figures import clock_state, decibels, duration, size
from sdrlinkd.cli.screens.rows import (
    LEVEL_STYLES,
    drops,
    heard_table,
    is_idle,
    robots_table,
    sent_table,
)
from sdrlinkd.health import line_told
from sdrlinkd.reports import Snapshot
from sdrlinkd.tables import FittedTable, figure, words, wrapped

INDENT = 7
REASON_LINES = 2
MOST_LINES = 3
"""Most tones and narrow signals that are named."""


class StatusScreen:
    """A snapshot in at most `height` lines; None: all of it."""

    def __init__(self, snapshot: Snapshot, height: int | None) -> None:
        self._snapshot = snapshot
        self._height = height

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        if self._height is None:
            yield from everything(self._snapshot, options.max_width)
        else:
            yield from _fitted(self._snapshot, options.max_width, self._height)


@dataclass
class _Block:
    """A part of the screen whose end can be cut off: a table's rows, or lines of text."""

    thing: str
    """The word for a row: topic, robot, …; empty: omitted rows are not mentioned."""
    table: FittedTable | None
    lines: list[Text]
    turn: int = 0
    """Number of rows that each table gets before this block gets its first line."""

    def heights(self, width: int) -> list[int]:
        """Lines that each row or text takes."""
        if self.table is not None:
            return self.table.heights(width)
        return [1 + line.plain.count("\n") for line in self.lines]

    def drawn(self, width: int, n: int) -> list[RenderableType]:
        """The first `n` rows or texts, ready to be printed."""
        if self.table is not None:
            return [self.table.fitted(width, n)] if n else []
        return [*self.lines[:n]]


def verdict(snapshot: Snapshot, width: int, *, whole: bool = False) -> Text:
    """The verdict's level, and as many of its reasons as two lines hold, or all if `whole`."""
    level, reasons = snapshot.verdict.level, snapshot.verdict.reasons
    told = f"{level}, {snapshot.verdict.protection}"
    room = REASON_LINES * width - len("; + 99 more reasons: --all")
    for at, reason in enumerate(reasons):
        longer = f"{told}{'; ' if at else ': '}{reason}"
        if at and len(longer) > room and not whole:
            told += f"; + {_count(len(reasons) - at, 'more reason')}: --all"
            break
        told = longer
    text = Text(wrapped(told, width))
    text.stylize(LEVEL_STYLES.get(level, "bold"), 0, len(level))
    return text


def head(snapshot: Snapshot, width: int, *, whole: bool = False) -> list[Text]:
    """The lines below the verdict: robot, radio, channel, and the two ledgers.

    Unless `whole`, the settings of a radio that is up are left out.
    """
    pdu_link, link = snapshot.carrier, snapshot.link
    named = f" ({snapshot.namespace})" if snapshot.namespace else ""
    lag = f", loop lag {snapshot.loop_lag_ms:.1f} ms"
    robot = f"{snapshot.node}{named}, {snapshot.state}, up {duration(snapshot.uptime_s)}{lag}"
    radio = f"{pdu_link.kind} {pdu_link.state}"
    if pdu_link.state != "up" and pdu_link.since_s:
        radio += f" since {duration(pdu_link.since_s)}"
    if pdu_link.detail and (whole or pdu_link.state != "up"):
        radio += f" ({pdu_link.detail})"
    if pdu_link.level_dbfs is not None:
        radio += (
            f"; level {decibels(pdu_link.level_dbfs)} dBFS, clipped {pdu_link.clipped_pct:.2f} %"
        )
    air = f"sent {link.air_sent_pct:.1f} %, heard {link.air_heard_pct:.1f} %"
    air += f"; {link.access}" if link.access != "none" else ""
    air += f"; PDUs of {link.pdu_size} B"
    if link.repeats.pdus:
        air += f"; {link.repeats.pdus} PDUs sent again"
    if link.bursts_late:
        air += f"; {link.bursts_late} late bursts resent"
    tx, rx = link.tx, link.rx
    waiting = ", ".join(f"{count} {label}" for label, count in tx.queued_by_class.items() if count)
    queue = f" ({waiting}; {size(tx.queued_bytes)})" if tx.queued else ""
    out = (
        f"{tx.accepted} in = {tx.sent} sent + {tx.queued} queued{queue} + {tx.in_flight} in flight "
        f"+ {sum(tx.dropped.values())} dropped"
    )
    into = (
        f"{rx.pdus_heard} PDUs, {rx.started} started = {rx.delivered} delivered + {rx.held} "
        f"incomplete + {sum(rx.dropped.values())} lost"
    )
    lines = [("robot", robot), ("radio", radio), ("air", air), ("out", out), ("in", into)]
    if pdu_link.lines:
        lines.insert(2, ("cut", "; ".join(line_told(each) for each in pdu_link.lines[:MOST_LINES])))
    texts = [_labelled(label, told, width) for label, told in lines]
    if pdu_link.state != "up":
        texts[1].stylize("red")
    return texts


def everything(snapshot: Snapshot, width: int) -> list[RenderableType]:
    """The screen of `--all`: every topic, robot and reason."""
    link = snapshot.link
    parts: list[RenderableType] = [
        verdict(snapshot, width, whole=True),
        *head(snapshot, width, whole=True),
    ]
    counters = dict(snapshot.carrier.counters)
    air_ms = counters.pop("air_cpu_ms", 0)
    counted = ", ".join(f"{key} {n}" for key, n in counters.items() if n)
    if counted:
        parts.append(_labelled("counts", counted, width))
    carrier = snapshot.carrier
    runs = [carrier.engine, carrier.scheduling and f"runs with {carrier.scheduling}"]
    if any(runs):
        parts.append(_labelled("modem", ", ".join(filter(None, runs)), width))
    if air_ms:
        share = air_ms / 10 / max(1.0, snapshot.uptime_s)
        told = f"simulating it takes {share:.1f} % of a core, which a physical radio does not"
        parts.append(_labelled("air", told, width))
    parts += [*_receipts(snapshot, width), Text()]
    parts.append(sent_table(link.topics, rule=True))
    if link.received:
        parts.append(heard_table(link.received, rule=True))
    if link.neighbors:
        parts.append(robots_table(link.neighbors, rule=True))
    found = drops(snapshot)
    if found:
        table = FittedTable("dropped", (words("what"), words("reason"), figure("count")))
        for what, reason, count in found:
            table.add(what, reason, str(count))
        parts.append(table)
    return [*parts, *_clocks(snapshot, width), *_notes(snapshot, width)]


def _fitted(snapshot: Snapshot, width: int, height: int) -> list[RenderableType]:
    top: list[Text] = [verdict(snapshot, width), *head(snapshot, width)]
    blocks = _blocks(snapshot, width)
    room = height - sum(1 + line.plain.count("\n") for line in top)
    shown = _chosen(blocks, width, room)
    if any(n < len(block.heights(width)) for block, n in zip(blocks, shown, strict=True)):
        # The line on what is left out needs room, too.
        shown = _chosen(blocks, width, room - 1)
        room -= 1
    left = room - sum(_cost(block, width, n) for block, n in zip(blocks, shown, strict=True))
    tables = sum(1 for block, n in zip(blocks, shown, strict=True) if block.table and n)
    parts: list[RenderableType] = [*top]
    for block, n in zip(blocks, shown, strict=True):
        if block.table and n and left >= tables:
            parts.append(Text())
        parts += block.drawn(width, n)
    rest = _left_out(blocks, shown, width)
    return [*parts, Text(f"+ {rest}: --all", style="bold")] if rest else parts


def _blocks(snapshot: Snapshot, width: int) -> list[_Block]:
    """The blocks from top to bottom; the first one gets its line first."""
    link = snapshot.link
    busy_out = [topic for topic in link.topics if not is_idle(topic)]
    busy_in = [topic for topic in link.received if not is_idle(topic)]
    return [
        _Block("robot", robots_table(link.neighbors, rule=False), []),
        _Block("topic", sent_table(busy_out, rule=False), []),
        _Block("topic", heard_table(busy_in, rule=False), []),
        _Block("", None, _dropped(snapshot, width)),
        _Block("", None, _idle(snapshot, width)),
        _Block("note", None, _notes(snapshot, width), turn=3),
        _Block("", None, _clocks(snapshot, width), turn=3),
        _Block("", None, _receipts(snapshot, width), turn=3),
    ]


def _chosen(blocks: Sequence[_Block], width: int, room: int) -> list[int]:
    """How many rows each block shows: blocks get rows in turn until nothing more fits."""
    heights = [block.heights(width) for block in blocks]
    shown = [0] * len(blocks)
    grew, turn = True, 0
    while grew or turn <= max(block.turn for block in blocks):
        grew, turn = False, turn + 1
        for at, block in enumerate(blocks):
            if shown[at] == len(heights[at]) or turn <= block.turn:
                continue
            cost = heights[at][shown[at]] + (block.table is not None and not shown[at])
            if cost <= room:
                shown[at] += 1
                room -= cost
                grew = True
    return shown


def _cost(block: _Block, width: int, n: int) -> int:
    return sum(block.heights(width)[:n]) + (block.table is not None and n > 0)


def _left_out(blocks: Sequence[_Block], shown: Sequence[int], width: int) -> str:
    """What is not on the screen, such as "6 topics, 2 robots"."""
    missing: dict[str, int] = {}
    for block, n in zip(blocks, shown, strict=True):
        thing = block.thing or "more line"
        missing[thing] = missing.get(thing, 0) + len(block.heights(width)) - n
    order = ("topic", "robot", "note", "more line")
    return ", ".join(_count(missing[thing], thing) for thing in order if missing.get(thing))


def _dropped(snapshot: Snapshot, width: int) -> list[Text]:
    found = [f"{reason} {count}" for _, reason, count in drops(snapshot)]
    return [_one_line("drops", [("", found)], width)] if found else []


def _idle(snapshot: Snapshot, width: int) -> list[Text]:
    """A line with the names of idle topics; empty if there are none."""
    link = snapshot.link
    out = [each.name.rsplit("/", 1)[-1] for each in link.topics if is_idle(each)]
    into = [each.republished_as or each.name for each in link.received if is_idle(each)]
    if not out and not into:
        return []
    line = _one_line("idle", [("out: ", out), ("in: ", into)], width)
    line.stylize("dim")
    return [line]


def _one_line(label: str, groups: Sequence[tuple[str, Sequence[str]]], width: int) -> Text:
    """A line with as many words as fit, and the number of omitted words at its end."""
    words = [
        (f"{'; ' if started else ''}{title}" if not at else ", ") + word
        for started, (title, group) in enumerate(g for g in groups if g[1])
        for at, word in enumerate(group)
    ]
    line = label.ljust(INDENT)
    for at, word in enumerate(words):
        rest = len(words) - at
        if len(line + word) + (len(f", + {rest - 1} more") if rest > 1 else 0) > width:
            return Text(f"{line}, + {rest} more")
        line += word
    return Text(line)


def _notes(snapshot: Snapshot, width: int) -> list[Text]:
    told = [f"note: {notice}" for notice in snapshot.notices]
    if snapshot.bus.bad_envelope_last:
        told.append(f"note: last message refused by the bus: {snapshot.bus.bad_envelope_last}")
    return [Text(wrapped(each, width), style="yellow") for each in told]


def _clocks(snapshot: Snapshot, width: int) -> list[Text]:
    """A line on how well other robots' clocks are known; empty if none is reported."""
    known = [(each.src, each.clock) for each in snapshot.link.neighbors if each.clock]
    told = "; ".join(f"{src} {clock_state(clock)}" for src, clock in known)
    return [_labelled("clocks", f"of robots: {told}", width)] if told else []


def _receipts(snapshot: Snapshot, width: int) -> list[Text]:
    """A line on receipts that were unsent or unexpected; empty if there are none."""
    link = snapshot.link
    parts = (
        (link.receipts_untold, "unsent for lack of room"),
        (link.receipts_unasked, "unexpected"),
    )
    told = ", ".join(f"{count} {words}" for count, words in parts if count)
    return [Text(wrapped(f"receipts: {told}", width))] if told else []


def _labelled(label: str, told: str, width: int) -> Text:
    """A sentence after its label, with further lines indented."""
    lines = wrapped(told, width - INDENT).split("\n")
    text = Text(label.ljust(INDENT), style="")
    text.stylize("bold", 0, len(label))
    return text.append(f"\n{' ' * INDENT}".join(lines))


def _count(n: int, thing: str) -> str:
    return f"{n} {thing}{'' if n == 1 else 's'}"
