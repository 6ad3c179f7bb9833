"""`topic hz`, `topic bw`, `topic delay`: measure a topic, like `ros2 topic`."""

import math
import time
from pathlib import Path
from typing import Annotated

import typer

from sdrlinkd.asking import ask_status
from sdrlinkd.cli.app import RuntimeDir, app, connect
from sdrlinkd.cli.completion import heard_names
from sdrlinkd.cli.spans import Bandwidth, Delay, Measure, Rate
from sdrlinkd.client import ControlClient, Subscriber
from sdrlinkd.errors import UserError, did_you_mean
from sdrlinkd.reports import Snapshot

topic_app = typer.Typer(help="Rate, bandwidth and delay of a received topic.", no_args_is_help=True)
app.add_typer(topic_app, name="topic")

TELL_S = 1.0
WINDOW = 10_000

Heard = Annotated[
    str,
    typer.Argument(
        metavar="NAME", help="Bus topic, such as /rx_robot_2/odom.", autocompletion=heard_names
    ),
]
Window = Annotated[
    int, typer.Option("--window", "-w", min=2, help="Number of latest messages averaged.")
]
Count = Annotated[
    int, typer.Option("--count", "-n", min=0, help="Messages to receive; 0: until Ctrl-C.")
]
Duration = Annotated[float | None, typer.Option(min=0.01, max=1e6, help="Seconds to measure.")]


@topic_app.command()
def hz(
    name: Heard,
    window: Window = WINDOW,
    count: Count = 0,
    duration: Duration = None,
    runtime_dir: RuntimeDir = None,
) -> None:
    """Measure a topic's rate: mean in Hz, and the intervals between messages."""
    _measure(name, Rate(window), Rate(1 << 24), count, duration, runtime_dir)


@topic_app.command()
def bw(
    name: Heard,
    window: Window = WINDOW,
    count: Count = 0,
    duration: Duration = None,
    runtime_dir: RuntimeDir = None,
) -> None:
    """Measure a topic's bandwidth: payload bytes per second, and message sizes."""
    _measure(name, Bandwidth(window), Bandwidth(1 << 24), count, duration, runtime_dir)


@topic_app.command()
def delay(
    name: Heard,
    window: Window = WINDOW,
    count: Count = 0,
    duration: Duration = None,
    runtime_dir: RuntimeDir = None,
) -> None:
    """Measure a topic's delay: the age of messages at delivery; needs no synchronized clocks."""
    _measure(name, Delay(window), Delay(1 << 24), count, duration, runtime_dir)


def _measure(
    name: str,
    lately: Measure,
    whole: Measure,
    count: int,
    duration: float | None,
    runtime_dir: Path | None,
) -> None:
    """Print `lately` every second until Ctrl-C or the end, then `whole`. Raises UserError."""
    with connect(runtime_dir) as control:
        snapshot = ask_status(control)
        _refuse_own(name, snapshot)
        hint = _never_heard(name, snapshot, control)
    if hint:
        typer.echo(hint, err=True)
    began_s = tell_s = time.monotonic()
    until_s = math.inf if duration is None else began_s + duration
    heard = told = 0
    with Subscriber(name, directory=runtime_dir, depth=0) as subscriber:
        try:
            while (now_s := time.monotonic()) < until_s and not 0 < count <= heard:
                message = subscriber.receive(max(0.0, min(until_s, tell_s + TELL_S) - now_s))
                now_s = time.monotonic()
                if message is not None:
                    heard += 1
                    age_s = None if message.age_us is None else message.age_us / 1e6
                    for measure in (lately, whole):
                        measure.add(now_s, len(message.payload), age_s)
                if now_s >= tell_s + TELL_S:
                    tell_s = now_s
                    _say(lately.lines() if heard > told else ["no new messages"])
                    told = heard
        finally:
            typer.echo(f"{name}: {heard} messages in {time.monotonic() - began_s:.1f} s")
            _say(whole.lines())
    if not heard:
        raise UserError(f"{name}: no message received; `sdrlinkctl topics` lists received topics")


def _never_heard(name: str, snapshot: Snapshot, control: ControlClient) -> str:
    """A sentence on a topic that nobody has sent or declared so far; empty if somebody has."""
    known = {each.republished_as for each in snapshot.link.received}
    known |= {each["topic"] for each in control.ask("declared")}
    if name in known or name.endswith("*"):
        return ""
    return f"{name}: nothing of this name was heard so far{did_you_mean(name, known)}"


def _refuse_own(name: str, snapshot: Snapshot) -> None:
    heard = [each.republished_as for each in snapshot.link.received]
    if name in heard or name not in {each.name for each in snapshot.link.topics}:
        return
    raise UserError(
        f"{name}: this robot sends it; received topics have names such as "
        f"{heard[0] if heard else '/rx_robot_2/odom'} (sdrlinkctl topics)"
    )


def _say(lines: list[str]) -> None:
    for line in lines:
        typer.echo(line)
