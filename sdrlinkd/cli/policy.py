"""`set` and `why`: change and explain a topic's policy while the daemon runs."""

from math import inf
from typing import Annotated, Any

import msgspec
import typer

from sdrlinkd.cli.app import AsJson, RuntimeDir, app, connect
from sdrlinkd.cli.completion import one_of, robot_names, topic_names
from sdrlinkd.cli.reserving import answer_of_team, asked_air, verdict_words
from sdrlinkd.errors import UserError
from sdrlinkd.units import LONG_LIFESPAN_S, octets, seconds

Topic = Annotated[str, typer.Argument(help="Topic name on the bus or in the registry.",
                                      autocompletion=topic_names)]  # fmt: skip
Text = str | None
QOS = ("urgent", "latency", "default", "bulk")


@app.command("set")
def set_policy(
    topic: Topic,
    qos: Annotated[
        Text, typer.Option(help="urgent, latency, default or bulk.", autocompletion=one_of(*QOS))
    ] = None,
    priority: Annotated[int | None, typer.Option(help="0 to 127; 127 is the most urgent.")] = None,
    weight: Annotated[
        float | None,
        typer.Option(help="Share of the air among topics of its class and priority; usually 1."),
    ] = None,
    period: Annotated[
        Text, typer.Option(help="Least time between messages: 0.1, 100ms; 0: none.")
    ] = None,
    lifespan: Annotated[
        Text, typer.Option(help="Discard messages older than: 300ms, 2s, inf.")
    ] = None,
    deadman: Annotated[
        Text, typer.Option(help="Publish the stop message here after this long without a message.")
    ] = None,
    depth: Annotated[int | None, typer.Option(help="Most messages queued; 0: no limit.")] = None,
    history: Annotated[
        Text,
        typer.Option(help="keep_last or keep_all.", autocompletion=one_of("keep_last", "keep_all")),
    ] = None,
    durability: Annotated[
        Text,
        typer.Option(
            help="volatile or transient_local.",
            autocompletion=one_of("volatile", "transient_local"),
        ),
    ] = None,
    dst: Annotated[
        int | None,
        typer.Option(help="Destination robot; 255: all.", autocompletion=robot_names),
    ] = None,
    decimate: Annotated[int | None, typer.Option(help="Send one message in this many.")] = None,
    on_change: Annotated[
        bool | None,
        typer.Option(
            "--on-change/--always", help="Send a message only if it differs from the last one."
        ),
    ] = None,
    compress: Annotated[
        Text, typer.Option(help="none or zstd.", autocompletion=one_of("none", "zstd"))
    ] = None,
    max_bytes: Annotated[
        Text, typer.Option(help="Refuse larger messages: 64k; 0: no limit.")
    ] = None,
    queue_bytes: Annotated[Text, typer.Option(help="Most bytes queued; 0: no limit.")] = None,
    queue_s: Annotated[Text, typer.Option(help="Most airtime queued; 0: no limit.")] = None,
    reserve: Annotated[
        Text,
        typer.Option(
            help="Ask the team for air: RATE:SIZE, such as 50:1KB; none: give it back.",
            autocompletion=one_of("none", "1:1KB", "10:1KB", "50:1KB"),
        ),
    ] = None,
    runtime_dir: RuntimeDir = None,
    as_json: AsJson = False,
) -> None:
    """Change a topic's policy until the next restart or reload; prints old and new values."""
    given: dict[str, Any] = {
        "qos": qos,
        "priority": priority,
        "weight": weight,
        "period_s": None if period is None else seconds(period, "--period"),
        "lifespan_s": None if lifespan is None else seconds(lifespan, "--lifespan"),
        "deadman_s": None if deadman is None else seconds(deadman, "--deadman"),
        "depth": depth,
        "history": history,
        "durability": durability,
        "dst": dst,
        "decimate": decimate,
        "on_change": on_change,
        "compress": compress,
        "max_bytes": None if max_bytes is None else octets(max_bytes, "--max-bytes"),
        "queue_bytes": None if queue_bytes is None else octets(queue_bytes, "--queue-bytes"),
        "queue_s": None if queue_s is None else seconds(queue_s, "--queue-s"),
    }
    if reserve is not None:
        given.update(asked_air(reserve))
    changes = {key: value for key, value in given.items() if value is not None}
    if not changes:
        raise UserError("nothing to change; name at least one: sdrlinkctl set --help")
    with connect(runtime_dir) as control:
        answer = control.ask("set", {"topic": topic, **changes})
        verdict = answer_of_team(control, answer["topic"]) if changes.get("reserve") else None
    if as_json:
        told = answer if verdict is None else {**answer, "team": verdict}
        typer.echo(msgspec.json.encode(told).decode())
        return
    typer.echo(f"{answer['topic']}:")
    for key in changes:
        typer.echo(
            f"  {key}: {_shown(key, answer['old'][key])} -> {_shown(key, answer['new'][key])}"
        )
    lifespan_s = changes.get("lifespan_s", 0.0)
    if LONG_LIFESPAN_S < lifespan_s < inf and answer["new"]["qos"] in ("urgent", "latency"):
        typer.echo(
            f"warning: {answer['new']['qos']} messages may be {lifespan_s:g} s old when they "
            f"arrive; for milliseconds, give {lifespan_s:g}ms",
            err=True,
        )
    if verdict is not None:
        typer.echo(verdict_words(verdict))


@app.command()
def why(topic: Topic, runtime_dir: RuntimeDir = None, as_json: AsJson = False) -> None:
    """Explain in plain words what happens to a topic."""
    with connect(runtime_dir) as control:
        lines = control.ask("why", {"topic": topic})["why"]
    if as_json:
        typer.echo(msgspec.json.encode(lines).decode())
        return
    for line in lines:
        typer.echo(line)


def _shown(key: str, value: object) -> str:
    """A value of a policy's key, with its unit."""
    if value is None:
        return "that of its class" if key == "lifespan_s" else "as in [link]"
    unit = " s" if key.endswith("_s") else " B" if key.endswith("_bytes") else ""
    return (f"{value:g}" if isinstance(value, float) else str(value)) + unit
