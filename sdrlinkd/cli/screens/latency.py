"""The screen of `latency`: the parts of the delay, as figures and as a waterfall."""

from collections.abc import Callable, Sequence

from rich.console import RenderableType
from rich.text import Text

from sdrlinkd.cli.screens.figures import clock_state, milliseconds
from sdrlinkd.reports import LatencyReport, LinkReport, ReceivedTopicReport
from sdrlinkd.tables import NOTHING, FittedTable, bar, figure, words

PARTS = (
    ("queue", "queue_ms", "░", "yellow"),
    ("access", "access_ms", "▒", "magenta"),
    ("again", "again_ms", "!", "red"),
    ("source", "unsplit_ms", "░", "yellow"),
    ("frags", "reassembly_ms", "▓", "cyan"),
    ("air", "air_ms", "█", "blue"),
    ("rx", "handover_ms", "·", "green"),
)
"""Name, field, character and color of each part, in order of time."""
Timed = Sequence[tuple[ReceivedTopicReport, LatencyReport]]
MEANINGS = {
    "age": "from publication to delivery",
    "queue": "behind other messages",
    "access": "for the channel",
    "again": "after a failed burst",
    "source": "at the source, all in one",
    "frags": "from first fragment to last",
    "air": "the last one",
    "rx": "demodulation, delivery",
    "p99": "99 % are younger",
    "jitter": "of the period",
}
CLOCKS = (
    "clock offset: its host clock behind ours; rate: our radio's clock faster than its; bad "
    "stamps: times that cannot be"
)


def latency_screen(
    link: LinkReport, heard: Sequence[ReceivedTopicReport], *, whole: bool
) -> list[RenderableType]:
    """The waterfalls of `heard`, with all percentiles if `whole`, followed by the clocks."""
    timed = [(each, each.latency) for each in heard if each.latency is not None]
    clocks = _clocks(link)
    if not timed:
        return [Text("no message with a STAMP received yet: ask the daemon that receives"), *clocks]
    parts: list[RenderableType] = [_waterfalls(timed)]
    if whole:
        parts += [_percentiles(topic, latency) for topic, latency in timed]
    told = "; ".join(f"{head}: {MEANINGS[head]}" for head in _heads(timed))
    return [*parts, Text(told, style="dim"), *clocks, *([Text(CLOCKS, style="dim")] * bool(clocks))]


def _heads(timed: Timed) -> list[str]:
    """The heads of the figures' columns, from left to right."""
    return ["age", *(head for head, _ in _told(timed)), "p99", "jitter"]


def _told(timed: Timed) -> list[tuple[str, str]]:
    """Head and field of each part that is known of a topic."""
    return [
        (head, field)
        for head, field, *_ in PARTS
        if any(_part_ms(latency, field) is not None for _, latency in timed)
    ]


def _waterfalls(timed: Timed) -> FittedTable:
    told = _told(timed)
    table = FittedTable(
        "latency, recent means in ms",
        (
            words("topic"), figure("age"), *(figure(head, 1) for head, _ in told), figure("p99"),
            figure("jitter", 2), bar("", 3),
        ),
    )  # fmt: skip
    longest_ms = max(_total_ms(latency) for _, latency in timed)
    for topic, latency in timed:
        table.add(
            topic.republished_as or topic.name,
            milliseconds(_total_ms(latency)),
            *(milliseconds(_part_ms(latency, field)) for _, field in told),
            milliseconds(topic.age_ms_p99),
            milliseconds(latency.jitter_ms),
            _waterfall(latency, longest_ms),
        )
    return table


def _waterfall(latency: LatencyReport, longest_ms: float) -> Callable[[int], Text]:
    def draw(width: int) -> Text:
        drawn, at_ms, end = Text(), 0.0, 0
        for _, field, character, colour in PARTS:
            at_ms += _part_ms(latency, field) or 0.0
            begin, end = end, max(end, round(width * at_ms / longest_ms) if longest_ms else 0)
            drawn.append(character * (end - begin), style=colour)
        return drawn

    return draw


def _part_ms(latency: LatencyReport, field: str) -> float | None:
    if field == "unsplit_ms":
        # The source has not reported the parts of its wait.
        return latency.wait_ms if latency.queue_ms is None else None
    value: float | None = getattr(latency, field)
    return value


def _total_ms(latency: LatencyReport) -> float:
    return latency.wait_ms + latency.reassembly_ms + latency.air_ms + latency.handover_ms


def _percentiles(topic: ReceivedTopicReport, latency: LatencyReport) -> Text:
    """The percentiles of all ages since the start, the period and the stop messages of a topic."""
    told = ", ".join(
        f"{head if head == 'max' else 'p' + head} {milliseconds(value)}"
        for head, value in latency.percentiles_ms.items()
    )
    lines = [f"{topic.republished_as or topic.name}: all ages in ms: {told}"]
    if latency.period_ms is not None:
        lines.append(
            f"mean period {milliseconds(latency.period_ms)} ms, "
            f"jitter {milliseconds(latency.jitter_ms)} ms (Jd)"
        )
    if topic.stops:
        lines.append(f"stop messages published after a silence: {topic.stops}")
    return Text("\n".join(lines))


def _clocks(link: LinkReport) -> list[FittedTable]:
    known = [(each.src, each.clock) for each in link.neighbors if each.clock is not None]
    if not known:
        return []
    table = FittedTable(
        "clocks",
        (
            words("robot"), words("state", least=18), figure("clock offset"),
            figure("rate", 1), figure("jumps", 2), figure("bad stamps", 3),
        ),
    )  # fmt: skip
    for src, clock in known:
        host = NOTHING
        if clock.wall_offset_ms is not None and clock.wall_bound_us is not None:
            host = f"{clock.wall_offset_ms:.3f} ms ± {clock.wall_bound_us / 1e3:.3f}"
        table.add(
            str(src),
            clock_state(clock),
            host,
            NOTHING if clock.skew_ppm is None else f"{clock.skew_ppm:+.2f} ppm",
            str(clock.steps + clock.resets),
            str(clock.contradicted + clock.refused),
        )
    return [table]
