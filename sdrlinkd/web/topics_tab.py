"""The tab with the topics, what happens to each, and its policy."""

from collections.abc import Sequence
from functools import partial
from typing import Any

from nicegui import ui
from nicegui.events import GenericEventArguments

from sdrlinkd.client import QOS, NoDaemonError, RefusedError
from sdrlinkd.web.topic_data import (
    RECEIVED,
    SENT,
    SLIDERS,
    Slider,
    columns,
    nearest,
    received_rows,
    sent_rows,
    shown,
)
from sdrlinkd.web.viewer import Viewer

ABROAD = "This daemon is not within reach of the page's own host, so it cannot be asked."


class TopicsTab:
    """Two tables; a click on a row explains the topic."""

    is_fast = False

    def __init__(self, viewer: Viewer) -> None:
        self._viewer = viewer
        self._sent = self._table("Sent", SENT)
        self._received = self._table("Received", RECEIVED)
        self._dialog = ui.dialog().props("position=right")

    def update(self) -> None:
        """Show the present rows."""
        station = self._viewer.station
        snapshot = None if station is None else station.snapshot
        if snapshot is not None:
            self._sent.rows = sent_rows(snapshot)
            self._received.rows = received_rows(snapshot)

    def _table(self, title: str, names: Sequence[tuple[str, str]]) -> ui.table:
        table = ui.table(columns=columns(names), rows=[], row_key="key", title=title, pagination=0)
        table.props("flat bordered dense hide-bottom").classes("sdr-table")
        table.on("rowClick", self._clicked, [[], ["name", "key"], None])
        return table

    async def _clicked(self, event: GenericEventArguments) -> None:
        row = event.args[1]
        await self._explain(str(row["name"]), is_sent=str(row["key"]).startswith("sent "))

    async def _explain(self, topic: str, *, is_sent: bool) -> None:
        """Open a dialog about one topic."""
        self._dialog.clear()
        with self._dialog, ui.card().classes("sdr-topic"):
            ui.label(topic).classes("sdr-title")
            try:
                why = (await self._ask("why", {"topic": topic}))["why"]
                for sentence in why:
                    ui.label(sentence)
                if self._viewer.may_control and is_sent:
                    self._controls(topic, await self._ask("policy", {"topic": topic}))
            except (NoDaemonError, RefusedError) as error:
                ui.label(str(error)).classes("sdr-problem")
            ui.button("Close", on_click=self._dialog.close).props("flat")
        self._dialog.open()

    def _controls(self, topic: str, policy: dict[str, Any]) -> None:
        ui.separator()
        ui.label("Policy, until the next restart").classes("sdr-title")
        ui.select(
            list(QOS), label="Class", value=policy["qos"],
            on_change=lambda event: self._set(topic, "qos", event.value),
        ).classes("sdr-qos")  # fmt: skip
        for slider in SLIDERS:
            given = policy[slider.key]
            value = float("inf") if given == "inf" else given
            label = ui.label(f"{slider.label}: {shown(slider, value)}")
            bar = ui.slider(
                min=0, max=len(slider.values) - 1, step=1, value=nearest(slider, value)
            ).mark(slider.key)  # fmt: skip
            bar.props(f'aria-label="{slider.label}"')
            bar.on_value_change(partial(self._tell, slider, label))
            # When it is let go, not at each step.
            bar.on("change", partial(self._slid, topic, slider))

    def _tell(self, slider: Slider, label: ui.label, event: Any) -> None:  # noqa: ANN401
        label.text = f"{slider.label}: {shown(slider, slider.values[int(event.value)])}"

    async def _slid(self, topic: str, slider: Slider, event: GenericEventArguments) -> None:
        await self._set(topic, slider.key, slider.values[int(event.args)])

    async def _set(self, topic: str, key: str, value: Any) -> None:  # noqa: ANN401
        try:
            told = await self._ask("set", {"topic": topic, key: value})
        except (NoDaemonError, RefusedError) as error:
            ui.notify(str(error), type="negative")
            return
        ui.notify(f"{told['topic']}: {key} {told['old'][key]} → {told['new'][key]}")

    async def _ask(self, verb: str, arguments: dict[str, Any]) -> Any:  # noqa: ANN401
        station = self._viewer.station
        if station is None or station.ask is None:
            raise RefusedError("refused", ABROAD)
        return await station.ask(verb, arguments)
