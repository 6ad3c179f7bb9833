"""The command tree: it lists exactly what exists, and only the called command is loaded."""

import subprocess
import sys

import pytest
import typer
from typer.core import TyperGroup

from sdrlinkd.cli.app import app
from sdrlinkd.cli.commands import COMMANDS

HEAVY = ("textual", "numpy", "numba", "scipy", "rosbags", "phy", "sdrlinkd.link", "sdrlinkd.config")
SHORT = (
    "--version", "status --help", "why --help", "topics --help", "radio probe --help",
    "top --help", "list --help", "topic hz --help", "latency --help",
)  # fmt: skip


def one_line(text: str | None) -> str:
    return (text or "").partition("\n\n")[0]


@pytest.mark.slow
def test_every_command_is_listed_with_its_own_help():
    tree = typer.main.get_group(app)
    for name, listed in COMMANDS.items():
        _, command, rest = tree.resolve_command(typer.Context(tree), [name, "more"])
        assert (command.name, one_line(command.help), rest) == (name, listed.help, ["more"])
        assert isinstance(command, TyperGroup) or command.callback, "listed, and not there"
    assert typer.main.get_group(app).commands.keys() == COMMANDS.keys()


@pytest.mark.slow
def test_short_commands_wait_for_nothing_that_they_do_not_need():
    program = f"""
import sys
from sdrlinkd.cli import run
for line in {SHORT}:
    assert run(line.split()) == 0
    print("\\nheavy:", line, [each for each in {HEAVY} if each in sys.modules])
"""
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    told = [line for line in done.stdout.splitlines() if line.startswith("heavy:")]
    assert told == [f"heavy: {line} []" for line in SHORT]


def test_an_unknown_command_is_named_with_what_is_like_it():
    done = subprocess.run(
        [sys.executable, "-m", "sdrlinkd.cli", "stats"], capture_output=True, text=True, check=False
    )
    assert done.returncode == 2
    assert "Did you mean 'status'?" in done.stderr


@pytest.mark.slow
@pytest.mark.parametrize(("words", "count", "there"), [
    ("sdrlinkctl ", 1, [*COMMANDS]),
    ("sdrlinkctl re", 1, [name for name in COMMANDS if name.startswith("re")]),
    ("sdrlinkctl bag ", 2, ["info", "play", "record"]),
])  # fmt: skip
def test_tab_completes_commands(words, count, there):
    done = subprocess.run(
        [sys.executable, "-c", "from sdrlinkd.cli import main; main()"],
        env={"COMP_WORDS": words, "COMP_CWORD": str(count),
             "_SDRLINKCTL_COMPLETE": "complete_bash"},
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert done.stdout.split() == there
