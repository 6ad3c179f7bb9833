"""`topics`: what a daemon sends and hears, by name."""

import msgspec
import typer
from rich.console import Console

from sdrlinkd.cli.app import AsJson, RuntimeDir, app, connect
from sdrlinkd.cli.status import ask_status

topics_app = typer.Typer(help="Topics of the registry, and those heard from other robots.")
app.add_typer(topics_app, name="topics")


@topics_app.callback(invoke_without_command=True)
def topics(context: typer.Context, runtime_dir: RuntimeDir = None, as_json: AsJson = False) -> None:
    """Topics of the registry, and those heard from other robots."""
    if context.invoked_subcommand:
        return
    with connect(runtime_dir) as control:
        link = ask_status(control).link
    if as_json:
        typer.echo(msgspec.json.encode({"sent": link.topics, "heard": link.received}).decode())
        return
    console = Console()
    for topic in link.topics:
        console.print(
            f"{topic.topic_id:>2}  {topic.name}  [dim]{topic.type}[/dim]"
            + ("" if topic.subscribed else "  (not taken: see the key `topics`)")
        )
    for heard in link.received:
        console.print(f"<-  {heard.republished_as or heard.name}  [dim]robot {heard.src}[/dim]")
