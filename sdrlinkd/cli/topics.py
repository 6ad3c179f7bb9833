"""`topics`: lists the topics that a daemon sends and receives."""

import msgspec
import typer

from sdrlinkd.asking import ask_status
from sdrlinkd.cli.app import AsJson, RuntimeDir, app, connect
from sdrlinkd.reports import LinkReport
from sdrlinkd.tables import FittedTable, figure, screen_console, words

topics_app = typer.Typer(help="List topics of the registry, and those received from other robots.")
app.add_typer(topics_app, name="topics")


@topics_app.callback(invoke_without_command=True)
def topics(context: typer.Context, runtime_dir: RuntimeDir = None, as_json: AsJson = False) -> None:
    """List topics of the registry, and those received from other robots."""
    if context.invoked_subcommand:
        return
    with connect(runtime_dir) as control:
        link = ask_status(control).link
    if as_json:
        typer.echo(msgspec.json.encode({"sent": link.topics, "heard": link.received}).decode())
        return
    console = screen_console()
    for table in tables(link):
        console.print(table)


def tables(link: LinkReport) -> list[FittedTable]:
    """The table of sent topics and, if there are any, that of received topics."""
    sent = FittedTable("sent", (figure("id"), words("topic"), words("type", 2), words("", 1)))
    for topic in link.topics:
        left_out = "" if topic.subscribed else "not sent: see the key `topics`"
        sent.add(str(topic.topic_id), topic.name, topic.type, left_out)
    heard = FittedTable("heard", (words("topic"), figure("from robot")))
    for each in link.received:
        heard.add(each.republished_as or each.name, str(each.src))
    return [sent, heard] if heard.rows else [sent]
