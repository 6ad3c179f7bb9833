"""The command tree of sdrlinkctl, and how its errors end."""

import os
import signal
import sys
from importlib import import_module
from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperCommand, TyperGroup

from sdrlinkd import __version__
from sdrlinkd.cli.commands import COMMANDS
from sdrlinkd.client import ControlClient, MessageRefusedError, NoDaemonError, RefusedError
from sdrlinkd.errors import UserError
from sdrlinkd.parent import end_with_parent

DEBUG_VARIABLE = "SDRLINKD_DEBUG"


class Commands(TyperGroup):
    """Loads a command only when it is called, so that most need not wait for the modem's import."""

    def __init__(self, **settings: Any) -> None:  # noqa: ANN401 (as the library has it)
        super().__init__(**settings)
        listed = {name: TyperCommand(name, help=each.help) for name, each in COMMANDS.items()}
        self.commands = {**listed, **self.commands}

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:  # noqa: ANN401 (as above)
        """(name, command, remaining arguments) of the called command, after loading its modules."""
        name, listed, rest = super().resolve_command(ctx, args)
        if name is None or listed is None:
            return None, None, rest
        for module in COMMANDS[name].modules:
            import_module(f"{__package__}.{module}")
        return name, typer.main.get_group(app).commands[name], rest


app = typer.Typer(
    name="sdrlinkctl",
    cls=Commands,
    help="Inspects and controls sdrlinkd: ROS 2 messages between robots over software radio.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
)

RuntimeDir = Annotated[
    Path | None,
    typer.Option(
        "--runtime-dir",
        envvar="SDRLINKD_RUNTIME_DIR",
        help="Directory of the daemon's sockets; default: the system service's, else your own.",
        show_default=False,
    ),
]
RuntimeDirs = Annotated[
    list[Path] | None,
    typer.Option(
        "--runtime-dir",
        help="Daemon, by its runtime directory; may be repeated; default: all of this host.",
    ),
]
AsJson = Annotated[bool, typer.Option("--json", help="Print machine-readable JSON.")]
Watch = Annotated[
    bool,
    typer.Option("--watch", "-w", help="Refresh the screen until Ctrl-C, even across a restart."),
]


def main() -> None:
    """Run sdrlinkctl; the exit code is 2 for errors that a person can fix, 130 after Ctrl-C."""
    end_with_parent()
    # A closed terminal or a kill ends the program like Ctrl-C, so that nothing is left running.
    for number in (signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, lambda got, _: sys.exit(128 + got))
    sys.exit(run(sys.argv[1:]))


def run(arguments: list[str]) -> int:
    """Run one command line; returns the exit code."""
    try:
        app(arguments, prog_name="sdrlinkctl")
    except SystemExit as done:
        return done.code if isinstance(done.code, int) else 1
    except KeyboardInterrupt:
        return 130
    except (UserError, MessageRefusedError, NoDaemonError, RefusedError) as error:
        sys.stderr.write(f"sdrlinkctl: {error}\n")
        return 2
    except OSError as error:
        sys.stderr.write(f"sdrlinkctl: {error.filename or ''}: {error.strerror or error}\n")
        return 2
    except Exception as error:
        if os.environ.get(DEBUG_VARIABLE):
            raise
        sys.stderr.write(
            f"sdrlinkctl: internal error: {type(error).__name__}: {error}; please report it with "
            f"the traceback that {DEBUG_VARIABLE}=1 prints\n"
        )
        return 1
    return 0


def connect(runtime_dir: Path | None, timeout_s: float = 5.0) -> ControlClient:
    """A client of the running daemon's control socket."""
    return ControlClient(runtime_dir, timeout_s)


@app.callback(invoke_without_command=True)
def _root(
    version: Annotated[bool, typer.Option("--version", help="Print the version and exit.")] = False,
) -> None:
    if version:
        typer.echo(f"sdrlinkctl {__version__}")
        raise typer.Exit
