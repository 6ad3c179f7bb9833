"""Dialogs of `top`: an explanation, and a form for a topic's policy."""

import asyncio
from collections.abc import Callable
from typing import Any, ClassVar

from textual.app import ComposeResult
from textual.binding import BindingType
from textual.containers import Vertical
from textual.screen import ModalScreen
from textual.widgets import Input, Label, Static

from sdrlinkd.client import NoDaemonError, RefusedError
from sdrlinkd.errors import UserError
from sdrlinkd.units import seconds

Ask = Callable[[str, dict[str, Any]], Any]


class Explanation(ModalScreen[None]):
    """A box with sentences; any key closes it."""

    def __init__(self, title: str, lines: list[str]) -> None:
        super().__init__()
        self._title, self._lines = title, lines

    def compose(self) -> ComposeResult:
        """The box: title, sentences and a hint."""
        with Vertical(classes="box"):
            yield Label(self._title, classes="title", markup=False)
            yield Static("\n".join(self._lines), markup=False)
            yield Label("any key: back", classes="hint")

    def on_key(self) -> None:
        """Close the box on any key."""
        self.dismiss()


class PolicyForm(ModalScreen[str]):
    """A form for a policy; Enter sends the fields that were filled in, Escape cancels."""

    BINDINGS: ClassVar[list[BindingType]] = [("escape", "cancel", "Back")]
    FIELDS = (
        ("qos", "class", "urgent, latency, default or bulk"),
        ("priority", "priority", "0 to 127; 127 is the most urgent"),
        ("period_s", "period", "least time between messages: 100ms; 0: none"),
        ("lifespan_s", "lifespan", "discard older messages: 300ms, 2s, inf"),
        ("depth", "depth", "most messages queued; 0: no limit"),
    )

    def __init__(self, topic: str, now: dict[str, str], ask: Ask) -> None:
        super().__init__()
        self._topic, self._now, self._ask = topic, now, ask

    def compose(self) -> ComposeResult:
        """The form, with an empty line per field; fields left empty are not changed."""
        with Vertical(classes="box"):
            yield Label(f"policy of {self._topic}", classes="title", markup=False)
            for key, label, help_text in self.FIELDS:
                now = f" (now {self._now[key]})" if key in self._now else ""
                yield Label(f"{label}{now}: {help_text}", markup=False)
                yield Input(id=key, placeholder="unchanged", compact=True)
            yield Label("", id="problem", markup=False)
            yield Label("Enter: set    Tab: next    Escape: back", classes="hint")

    def action_cancel(self) -> None:
        """Close the form and change nothing."""
        self.dismiss("")

    async def on_input_submitted(self) -> None:
        """Set the fields that were filled in; if the daemon refuses, show why and keep the form."""
        try:
            changes = self._changes()
            if not changes:
                self.dismiss("")
                return
            told = await asyncio.to_thread(self._ask, "set", {"topic": self._topic, **changes})
        except (UserError, RefusedError, NoDaemonError) as error:
            self.query_one("#problem", Label).update(str(error))
            return
        self.dismiss(
            f"{told['topic']}: "
            + ", ".join(f"{key} {told['old'][key]} -> {told['new'][key]}" for key in changes)
        )

    def _changes(self) -> dict[str, Any]:
        """The fields that were filled in, as values for the daemon. Raises UserError."""
        given = {key: self.query_one(f"#{key}", Input).value.strip() for key, *_ in self.FIELDS}
        return {key: _value(key, text) for key, text in given.items() if text}


def _value(key: str, text: str) -> str | int | float:
    if key.endswith("_s"):
        return seconds(text, key.removesuffix("_s"))
    if key == "qos":
        return text
    try:
        return int(text)
    except ValueError:
        raise UserError(f"{key}: got {text}; allowed: a whole number") from None
