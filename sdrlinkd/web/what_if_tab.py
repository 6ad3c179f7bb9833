"""The tab that tries another MCS, rate or policy on the last minute's traffic."""

from functools import partial
from math import inf
from typing import Any

from nicegui import ui

from sdrlinkd.client import QOS, NoDaemonError, RefusedError
from sdrlinkd.errors import UserError
from sdrlinkd.web.topic_data import SLIDERS, Slider, columns, nearest, shown
from sdrlinkd.web.viewer import Viewer
from sdrlinkd.web.what_if import Choice, Outcome, Traffic, foresee, loads_of, traffic_of

COLUMNS = (
    ("name", "topic"), ("qos", "class"), ("rate", "a second"), ("size", "bytes"),
    ("air", "air, %"), ("now", "worst case now"), ("then", "worst case then"),
    ("dropped", "dropped then"),
)  # fmt: skip
FACTORS = (0.25, 0.5, 1, 2, 4)
"""Rates to try, as multiples of the present one."""
MOST_ROBOTS = 32
NO_TRAFFIC = "Nothing was sent in the last minute, so there is nothing to try."


class WhatIfTab:
    """Choices, and what would come of them beside what is now."""

    is_fast = False

    def __init__(self, viewer: Viewer) -> None:
        self._viewer = viewer
        self._traffic: Traffic | None = None
        self._choice = Choice()
        self._topic: int | None = None
        with ui.row().classes("sdr-row"):
            ui.button("take the last minute", on_click=self._take).props("unelevated")
            self._told = ui.label("Takes what this robot sent in the last minute.")
        self._knobs = ui.row().classes("sdr-row")
        self._verdict = ui.label().classes("sdr-title")
        self._advice = ui.label()
        self._table = ui.table(columns=columns(COLUMNS), rows=[], row_key="name", pagination=0)
        self._table.props("flat bordered dense hide-bottom").classes("sdr-table")
        self._policy = ui.column().classes("sdr-policy")
        viewer.on_choose.append(self._forget)

    def update(self) -> None:
        """Nothing: what was taken stays until it is taken anew."""

    def _forget(self) -> None:
        self._traffic, self._topic, self._choice = None, None, Choice()
        self._knobs.clear()
        self._policy.clear()
        self._table.rows = []
        self._verdict.text = self._advice.text = ""

    async def _take(self) -> None:
        """Take the traffic of the last minute, and the settings in force."""
        self._forget()
        station = self._viewer.station
        if station is None or station.ask is None or station.snapshot is None:
            self._told.text = "This daemon is not within reach."
            return
        loads, span_s = loads_of(list(station.history.recent))
        if not loads:
            self._told.text = NO_TRAFFIC
            return
        try:
            config = await station.ask("config")
            policies = {
                each.topic_id: await station.ask("policy", {"topic": each.name}) for each in loads
            }
            self._traffic = traffic_of(station.snapshot.node, loads, span_s, config, policies)
        except (NoDaemonError, RefusedError, UserError) as error:
            self._told.text = str(error)
            return
        self._told.text = f"{len(loads)} topics of the last {span_s:.0f} s; sizes are means"
        self._show_knobs(self._traffic)
        self._foresee()

    def _show_knobs(self, traffic: Traffic) -> None:
        modem = traffic.config.modem
        rates = {modem.rate_hz * each: f"{modem.rate_hz * each / 1e6:g} Msps" for each in FACTORS}
        topics = {each.topic_id: each.name for each in traffic.loads}
        with self._knobs:
            ui.select(
                {i: f"MCS {i}" for i in range(10)}, label="MCS", value=modem.mcs,
                on_change=lambda event: self._choose("mcs", event.value),
            ).mark("mcs")  # fmt: skip
            ui.select(
                rates, label="Sample rate", value=modem.rate_hz,
                on_change=lambda event: self._choose("rate_hz", event.value),
            )  # fmt: skip
            ui.number(
                "Robots that send this", min=1, max=MOST_ROBOTS, step=1, format="%d",
                on_change=lambda event: self._choose("robots", event.value and int(event.value)),
            )  # fmt: skip
            ui.select(
                topics, label="Policy of", clearable=True,
                on_change=lambda event: self._show_policy(event.value),
            ).classes("sdr-stations")  # fmt: skip

    def _choose(self, key: str, value: Any) -> None:  # noqa: ANN401
        setattr(self._choice, key, value)
        self._foresee()

    def _show_policy(self, topic_id: int | None) -> None:
        self._policy.clear()
        if topic_id is None or self._traffic is None:
            return
        policy = self._traffic.policies[topic_id]
        changed = self._choice.policies.setdefault(topic_id, {})
        with self._policy:
            ui.select(
                list(QOS), label="Class", value=changed.get("qos", policy.qos),
                on_change=lambda event: self._change(topic_id, "qos", event.value),
            )  # fmt: skip
            for slider in SLIDERS:
                value = changed.get(slider.key, getattr(policy, slider.key))
                label = ui.label(f"{slider.label}: {shown(slider, value)}")
                bar = ui.slider(
                    min=0, max=len(slider.values) - 1, step=1, value=nearest(slider, value)
                )  # fmt: skip
                bar.props(f'aria-label="{slider.label}"')
                bar.on_value_change(partial(self._slid, topic_id, slider, label))

    def _slid(self, topic_id: int, slider: Slider, label: ui.label, event: Any) -> None:  # noqa: ANN401
        value = slider.values[int(event.value)]
        label.text = f"{slider.label}: {shown(slider, value)}"
        self._change(topic_id, slider.key, value)

    def _change(self, topic_id: int, key: str, value: Any) -> None:  # noqa: ANN401
        self._choice.policies.setdefault(topic_id, {})[key] = value
        self._foresee()

    def _foresee(self) -> None:
        """Show the plan of what is, and of what would be."""
        traffic = self._traffic
        if traffic is None:
            return
        try:
            _, now = foresee(traffic, Choice(robots=self._choice.robots))
            plan, then = foresee(traffic, self._choice)
        except UserError as error:
            self._verdict.text, self._advice.text = "This cannot be tried.", str(error)
            return
        fits = "It fits" if plan.is_feasible else "It does not fit"
        self._verdict.text = f"{fits}: {100 * plan.air:.0f} % of what the channel carries"
        self._advice.text = " ".join(plan.advice)
        self._table.rows = [_row(a, b) for a, b in zip(now, then, strict=True)]


def _row(now: Outcome, then: Outcome) -> dict[str, Any]:
    topic = then.topic
    return {
        "name": topic.name,
        "qos": topic.qos,
        "rate": f"{topic.rate_hz:.3g}",
        "size": f"{topic.size:.0f}",
        "air": f"{100 * topic.air:.1f}",
        "now": _worst(now),
        "then": _worst(then),
        "dropped": f"{100 * then.dropped:.0f} %" if then.dropped else "",
    }


def _worst(outcome: Outcome) -> str:
    """The worst case in words."""
    topic = outcome.topic
    if topic.worst_s == inf:
        return "no bound"
    late = ", expires before" if topic.is_late else ""
    return f"{1e3 * topic.worst_s:.1f} ms{late}"
