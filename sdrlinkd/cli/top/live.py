"""The live screen of `top`: it renders snapshots and has no figures of its own."""

import asyncio
from collections.abc import Callable
from typing import ClassVar

from rich.console import Group, RenderableType
from rich.text import Text
from textual.app import App, ComposeResult
from textual.binding import Binding, BindingType
from textual.widgets import DataTable, Footer, Input, Static

from sdrlinkd.cli.screens import duration, robots_table, verdict
from sdrlinkd.cli.top.dialogs import Ask, Explanation, PolicyForm
from sdrlinkd.cli.top.history import PERIOD_S, History
from sdrlinkd.cli.top.topics import ORDERS, TopicRow, topic_rows, topics_table
from sdrlinkd.client import NoDaemonError, RefusedError
from sdrlinkd.reports import Snapshot

MINUTES = "(the last 4 minutes)"
HELP = [
    "w, Enter   explain what happens to the selected topic",
    "p          change its policy, until the next restart or reload",
    "s          sort by the next column: worst, name, rate, bytes, age",
    "/          show only topics that contain a text: a name, a class, robot 2",
    "Escape     show all topics again",
    "↑ ↓        select a topic",
    "q, Ctrl-C  quit",
    "",
    "The sparklines show the last 4 minutes: the worst SNR of all neighbors,",
    "complete messages, airtime in use, queued messages, the latest age.",
]


class TopApp(App[None]):
    """The live screen of `top`.

    `look` is called every `period_s`. While the daemon is away, it returns None, and the text of
    `waiting` is shown.
    """

    TITLE = "sdrlinkctl top"
    ENABLE_COMMAND_PALETTE = False
    CSS = """
    #verdict, #robot { height: auto; max-height: 2; }
    #trend { height: 3; margin: 0; color: $accent; }
    #robots { height: auto; margin: 1 0; }
    DataTable { height: 1fr; }
    .old { text-opacity: 40%; }
    #filter { dock: bottom; display: none; height: 1; }
    ModalScreen { align: center middle; }
    .box { width: 76; max-width: 100%; height: auto; max-height: 100%; padding: 1 2;
           background: $panel; overflow-y: auto; }
    .title { text-style: bold; margin-bottom: 1; }
    .hint { color: $text-muted; margin-top: 1; }
    .box Label { width: 100%; }
    #problem { color: $error; }
    """
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("w", "why", "Why"),
        Binding("p", "policy", "Policy"),
        Binding("s", "sort", "Sort"),
        Binding("slash", "filter", "Filter", key_display="/"),
        Binding("escape", "unfilter", "All", show=False),
        Binding("question_mark,h", "help", "Help", key_display="?"),
        Binding("q", "quit", "Quit"),
        Binding("ctrl+c", "quit", show=False, priority=True),
    ]

    def __init__(
        self,
        look: Callable[[], Snapshot | None],
        ask: Ask,
        waiting: Callable[[], str],
        period_s: float = PERIOD_S,
    ) -> None:
        super().__init__()
        self._look, self._ask_daemon, self._waiting = look, ask, waiting
        self._period_s = period_s
        self._history = History()
        self._snapshot: Snapshot | None = None
        self._is_there = False
        self._order = next(iter(ORDERS))
        self._rows: list[TopicRow] = []
        names = ("verdict", "robot", "trend", "robots")
        self._verdict, self._robot, self._trend, self._robots = (
            Static(id=name, markup=False) for name in names
        )
        self._table: DataTable[Text] = DataTable(cursor_type="row")
        self._filter = Input(id="filter", placeholder="topic, class or robot 2", compact=True)

    def compose(self) -> ComposeResult:
        """The parts of the screen from top to bottom."""
        yield from (self._verdict, self._robot, self._trend, self._robots)
        yield self._table
        yield self._filter
        yield Footer(show_command_palette=False)

    def on_mount(self) -> None:
        """Start to poll the daemon."""
        self._table.focus()
        if self._period_s:
            self.set_interval(self._period_s, self._follow)
            self.call_after_refresh(self._follow)

    async def _follow(self) -> None:
        try:
            snapshot = await asyncio.to_thread(self._look)
        except RefusedError as error:
            self.notify(str(error), severity="error")
            return
        self.show(snapshot)

    def show(self, snapshot: Snapshot | None) -> None:
        """Show a new snapshot; None: the daemon does not answer."""
        # While the app quits, an answer may still come when there is no screen any more.
        if not self.is_running or not self._table.is_attached:
            return
        self._history.add(snapshot)
        self._is_there = snapshot is not None
        if snapshot is None:
            self._verdict.update(Text(self._waiting(), style="bold yellow"))
        else:
            self._snapshot = snapshot
        self._draw()

    def on_resize(self) -> None:
        """Redraw, as other columns may fit now."""
        self._draw()

    def _draw(self) -> None:
        """Draw the last snapshot, dimmed and without a verdict while the daemon is away."""
        at, width = self._snapshot, self.size.width
        if at is None or not width:
            return
        for part in (self._robot, self._trend, self._robots, self._table):
            part.set_class(not self._is_there, "old")
        if self._is_there:
            self._verdict.update(verdict(at, width))
        named = f" ({at.namespace})" if at.namespace else ""
        told = (
            f"robot {at.node}{named}  {at.carrier.kind} {at.carrier.state}  "
            f"up {duration(at.uptime_s)}  {at.bus.runtime_dir}"
        )
        self._robot.update(Text(told))
        self._trend.update(self._series(width))
        self._draw_robots(at, width)
        self._draw_topics(at, width)

    def _series(self, width: int) -> Text:
        """The series as text, two per line."""
        half = (width - 2) // 2
        lines = [*(series.line(half) for series in self._history.series), MINUTES]
        pairs = [lines[at : at + 2] for at in range(0, len(lines), 2)]
        return Text("\n".join("  ".join(pair) for pair in pairs))

    def _draw_robots(self, at: Snapshot, width: int) -> None:
        robots = at.link.neighbors
        most = max(2, self.size.height // 5)
        table = robots_table(robots, rule=False)
        shown = most if len(robots) <= most else most - 1
        self._robots.display = bool(robots)
        parts: list[RenderableType] = [table.fitted(width, shown)]
        if len(robots) > shown:
            parts.append(Text(f"+ {len(robots) - shown} robots: sdrlinkctl status --all", "bold"))
        self._robots.update(Group(*parts))

    def _draw_topics(self, at: Snapshot, width: int) -> None:
        selected = self._selected()
        scrolled = self._table.scroll_y
        self._rows = topic_rows(at, self._order, self._filter.value)
        table = topics_table(self._rows)
        # The scroll bar at the right takes two characters.
        widths = table.widths(width - 2)
        self._table.clear(columns=True)
        for place, n in widths.items():
            column = table.columns[place]
            head = Text(column.name, justify="right" if column.kind == "figure" else "left")
            self._table.add_column(head, width=n)
        for row, cells, height in zip(
            self._rows, table.texts(widths), table.heights(width - 2), strict=True
        ):
            self._table.add_row(*cells, key=row.key, height=height)
        if selected is not None:
            for index, row in enumerate(self._rows):
                if row.key == selected.key:
                    self._table.move_cursor(row=index, scroll=False)
                    break
        self._table.scroll_to(y=scrolled, animate=False)

    def _selected(self) -> TopicRow | None:
        index = self._table.cursor_row
        return self._rows[index] if 0 <= index < len(self._rows) else None

    def action_sort(self) -> None:
        """Switch to the next sort order of the topics."""
        orders = [*ORDERS]
        self._order = orders[(orders.index(self._order) + 1) % len(orders)]
        self.notify(f"sorted by {self._order}", timeout=2)
        self._draw()

    def action_filter(self) -> None:
        """Ask for a text that topics must contain."""
        self._filter.display = True
        self._filter.focus()

    def action_unfilter(self) -> None:
        """Show all topics again, without a filter."""
        self._filter.value = ""
        self.on_input_submitted()

    def on_input_changed(self) -> None:
        """Redraw while the filter is typed."""
        self._draw()

    def on_input_submitted(self) -> None:
        """Return to the table; the filter stays in force."""
        self._filter.display = bool(self._filter.value)
        self._table.focus()

    def on_data_table_row_selected(self) -> None:
        """Explain the selected topic when Enter is pressed."""
        self.run_worker(self.action_why())

    async def action_why(self) -> None:
        """Explain what happens to the selected topic."""
        row = self._selected()
        if row is None:
            return
        if row.source is not None:
            lines = [f"robot {row.source} sends it; run there: sdrlinkctl why {row.name}"]
        else:
            try:
                answer = await asyncio.to_thread(self._ask_daemon, "why", {"topic": row.name})
                lines = answer["why"]
            except (NoDaemonError, RefusedError) as error:
                lines = [str(error)]
        self.push_screen(Explanation(row.name, lines))

    def action_policy(self) -> None:
        """Open a form for the policy of the selected topic."""
        row = self._selected()
        if row is None or self._snapshot is None:
            return
        if row.source is not None:
            self.notify(f"robot {row.source} sends it; change its policy there")
            return
        now = next(each for each in self._snapshot.link.topics if each.name == row.name)
        known = {"qos": now.qos, "priority": str(now.priority)}
        self.push_screen(PolicyForm(row.name, known, self._ask_daemon), self._told)

    def action_help(self) -> None:
        """Show what the keys do."""
        self.push_screen(Explanation("keys", HELP))

    def _told(self, text: str | None) -> None:
        if text:
            self.notify(text, markup=False)
