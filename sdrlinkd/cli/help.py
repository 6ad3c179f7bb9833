"""`help`: how-to pages, configuration keys, ledger names and commands, in the terminal."""

from typing import Annotated

import typer
from rich.console import Console
from rich.markdown import Markdown
from rich.text import Text

from sdrlinkd.cli.app import app, run
from sdrlinkd.cli.commands import COMMANDS
from sdrlinkd.link import RX_PDU_REASONS, RX_REASONS, TX_REASONS
from sdrlinkd.manual import Key, find_how_to, find_key, glossary, how_tos, key_names, sections
from sdrlinkd.tables import FittedTable, screen_console, words

LEDGER = {
    "message sent": TX_REASONS,
    "PDU received": RX_PDU_REASONS,
    "message received": RX_REASONS,
}
MOST_COLUMNS = 100
"""Lines longer than this are hard to read, however wide the terminal is."""


def help_topics(incomplete: str) -> list[str]:
    """Everything that `help` knows and that begins with `incomplete`."""
    ledger = [name for reasons in LEDGER.values() for name in reasons]
    known = [*(page.name for page in how_tos()), *COMMANDS, *key_names(), *ledger, *glossary()]
    return [each for each in known if each.startswith(incomplete)]


@app.command("help")
def show_help(
    topic: Annotated[
        list[str] | None,
        typer.Argument(
            help="A page, a word, a configuration key or section, a ledger name, or a command.",
            autocompletion=help_topics,
        ),
    ] = None,
) -> None:
    """Show a how-to page, a word's meaning, a configuration key, a ledger name or a command."""
    screen = screen_console()
    name = " ".join(topic or ())
    if not name:
        _list_pages(screen)
    elif name.split()[0] in COMMANDS:
        raise typer.Exit(run([*(topic or ()), "--help"]))
    elif key := find_key(name):
        _print_key(screen, key)
    elif section := next((each for each in sections() if each.name == name), None):
        screen.print(Text(section.text))
        for each in section.keys:
            screen.print()
            _print_key(screen, each)
    elif reason := _ledger_name(name):
        screen.print(Text(reason))
    elif word := glossary().get(name.lower()):
        also = f"\nElsewhere: {word.elsewhere}." if word.elsewhere else ""
        screen.print(Text(word.name, "bold"))
        screen.print(Markdown(word.meaning), Text(also))
    else:
        page = find_how_to(name, help_topics(""))
        screen.print(Markdown(page.text), width=min(screen.width, MOST_COLUMNS))


def _list_pages(screen: Console) -> None:
    table = FittedTable("", (words("page"), words("what it answers", 1)))
    for page in how_tos():
        table.add(page.name, page.title)
    screen.print(table)
    screen.print(
        Text(
            "\nsdrlinkctl help PAGE, a word (TDMA), a configuration key (access.policy), a ledger "
            "name (tx_expired) or a command (bag play)"
        )
    )


def _print_key(screen: Console, key: Key) -> None:
    default = f" Default: {key.default}." if key.default else " Absent by default."
    screen.print(Text(key.path, "bold"))
    screen.print(Text(f"  {key.text}"), soft_wrap=False)
    screen.print(Text(f"  Takes {key.allowed}.{default}"))


def _ledger_name(name: str) -> str:
    """What a name of the ledger means, as a sentence; empty when it is none."""
    for what, reasons in LEDGER.items():
        if name in reasons:
            return f"{name} (a {what}, in the ledger): {reasons[name]}"
    return ""
