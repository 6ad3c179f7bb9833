"""`key`: keys of a team, which seal its PDUs."""

import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console

from sdrlinkd.cli.app import RuntimeDir, app, connect
from sdrlinkd.cli.completion import robot_names
from sdrlinkd.client import NoDaemonError
from sdrlinkd.errors import UserError

if TYPE_CHECKING:
    from sdrlinkd.config import Setup
    from sdrlinkd.keyring import KeyState, StoredKey
    from sdrlinkd.reports import SecurityReport, Snapshot

DEFAULT_CONFIG = Path("/etc/sdrlinkd/sdrlinkd.toml")
KEY_FILE, NEXT_FILE = Path("team.key"), Path("next.key")
N_KIDS = 4
STDIN = Path("-")

key_app = typer.Typer(help="Keys of a team, which seal its PDUs.", no_args_is_help=True)
app.add_typer(key_app, name="key")

ConfigFile = Annotated[
    Path, typer.Option("--config", help="Configuration of the robot.", metavar="FILE")
]


@key_app.command()
def generate(
    file: Annotated[Path, typer.Argument(help="File to write.", metavar="FILE")] = KEY_FILE,
) -> None:
    """Make the first key of a team."""
    from sdrlinkd.keyring import create_key_file, new_key

    key = new_key(0)
    create_key_file(file, [key])
    _say(f"wrote {file}, which only you can read", _told(key), *_next(file))


@key_app.command()
def rotate(
    file: Annotated[Path, typer.Argument(help="File to write.", metavar="FILE")] = NEXT_FILE,
    config: ConfigFile = DEFAULT_CONFIG,
) -> None:
    """Make the next key of a team, from which a lost robot is left out."""
    from sdrlinkd.keyring import create_key_file, new_key, read_key_file

    newest = read_key_file(Path(_setup(config).config.security.keys))[-1]
    key = new_key((newest.kid + 1) % N_KIDS)
    create_key_file(file, [key])
    _say(
        f"wrote {file}, which only you can read",
        _told(key),
        *_next(file),
        "each robot changes to it once all robots that it hears have it, or after 10 minutes; "
        "what seals with the old key is out then",
    )


@key_app.command()
def install(
    file: Annotated[
        Path | None,
        typer.Argument(help="File with the key; -: stdin; absent: the robot's own key file."),
    ] = None,
    config: ConfigFile = DEFAULT_CONFIG,
    replace: Annotated[
        bool, typer.Option("--replace", help="Use the new key in place of all others.")
    ] = False,
) -> None:
    """Install a key on this robot: beside the one in use, to which the robots then change."""
    from sdrlinkd.keyring import write_key_file

    setup = _setup(config)
    path = Path(setup.config.security.keys)
    state = _state(setup)
    state.check()
    owner = _owner(state.directory)
    given = _given(path if file is None else file)
    keys = _merged(_installed(path), given, state, path, replace=replace)
    for key in keys:
        state.install(key.key, owner)
    if file is not None:
        write_key_file(path, keys, owner)
    _say(*(f"installed: {_told(key)}" for key in given))
    if setup.config.security.mode == "off":
        _say(f'nothing is sealed yet: set mode = "seal" in [security] of {config}, at all robots')
        return
    _say(_reloaded(setup))


@key_app.command()
def show(
    file: Annotated[
        Path | None, typer.Argument(help="File with keys; absent: the robot's own key file.")
    ] = None,
    config: ConfigFile = DEFAULT_CONFIG,
) -> None:
    """Show the keys as words, to compare them with those of another robot."""
    from sdrlinkd.keyring import read_key_file

    if file is not None:
        _say(*map(_told, read_key_file(file)))
        return
    setup = _setup(config)
    keys = read_key_file(Path(setup.config.security.keys))
    state = _state(setup)
    in_use = state.load([key.key for key in keys]).in_use
    for key in keys:
        _say(_told(key) + (" (in use)" if key.fingerprint == in_use else ""))


@key_app.command()
def check(
    robot: Annotated[
        int, typer.Option("--with", help="Robot to check.", autocompletion=robot_names)
    ],
    runtime_dir: RuntimeDir = None,
) -> None:
    """Check whether another robot has the running daemon's key; exit code 1 if it has not."""
    from sdrlinkd.cli.status import ask_status
    from sdrlinkd.keyring import words_of

    with connect(runtime_dir) as control:
        snapshot = ask_status(control)
    security = snapshot.link.security
    if security.kid is None:
        _say("nothing is sealed here: security.mode is off")
        raise typer.Exit(1)
    own = f"key {security.kid}: {words_of(bytes.fromhex(security.fingerprint))}"
    told, is_good = _verdict(snapshot, security, robot)
    _say(f"robot {robot} {told}", f"our {own}")
    if not is_good:
        raise typer.Exit(1)


def _verdict(snapshot: "Snapshot", security: "SecurityReport", robot: int) -> tuple[str, bool]:
    """(what is known about a robot's key, whether it is the right one)."""
    if robot in security.proven:
        return "has our key, and has proven to be alive", True
    if robot in security.not_proven:
        return "has our key, and has not proven to be alive: does it hear us?", False
    for notice in snapshot.notices:
        for begin in (f"robot {robot} ", f"PDUs of robot {robot} "):
            if notice.startswith(begin) and any(word in notice for word in ("key", "clear")):
                return f"is not believed: {notice}", False
    return "was not heard in the last minute", False


def _setup(config: Path) -> "Setup":
    from sdrlinkd.config import load_config, make_setup

    return make_setup(load_config(config), config.parent, str(config))


def _state(setup: "Setup") -> "KeyState":
    from sdrlinkd.keyring import KeyState, state_dir

    source = Path(setup.source) if setup.source else None
    return KeyState(state_dir(setup.config.security.state_dir, source), setup.node_id)


def _given(file: Path) -> "list[StoredKey]":
    from sdrlinkd.keyring import parse_key_file, read_key_file

    if file == STDIN:
        return parse_key_file(sys.stdin.buffer.read(), "stdin")
    return read_key_file(file)


def _installed(path: Path) -> "list[StoredKey]":
    from sdrlinkd.keyring import read_key_file

    return read_key_file(path) if path.exists() else []


def _merged(
    installed: "list[StoredKey]", given: "list[StoredKey]", state: "KeyState", path: Path, *,
    replace: bool,
) -> "list[StoredKey]":  # fmt: skip
    """The keys to hold: the one in use, and the next one. Raises UserError."""
    if replace:
        return given
    fresh = [
        key for key in given if key.fingerprint not in {each.fingerprint for each in installed}
    ]
    for key in fresh:
        if any(each.kid == key.kid for each in installed):
            raise UserError(
                f"{path}: another key with kid {key.kid} is installed; allowed: the next key, made "
                "with sdrlinkctl key rotate, or --replace"
            )
    if fresh and len(installed) > 1:
        in_use = state.load([each.key for each in installed]).in_use
        installed = [each for each in installed if each.fingerprint == in_use] or installed[-1:]
    return [*installed, *fresh]


def _owner(directory: Path) -> tuple[int, int] | None:
    """Who shall own what root writes: the owner of the state directory."""
    if os.geteuid() != 0:
        return None
    about = directory.stat()
    return about.st_uid, about.st_gid


def _reloaded(setup: "Setup") -> str:
    """Make the running daemon take the keys; returns what happened."""
    given = setup.config.bus.runtime_dir
    try:
        with connect(Path(given) if given else None) as control:
            if control.ask("hello")["node"] != setup.node_id:
                return "the daemon that runs here is another robot's: reload this robot's daemon"
            return f"the daemon has re-read: {control.ask('reload')['reloaded']}"
    except NoDaemonError:
        return "no daemon runs; it takes the key when it starts"


def _told(key: "StoredKey") -> str:
    from sdrlinkd.keyring import words_of

    made = f", made {key.created}" if key.created else ""
    return f"key {key.kid}{made}: {words_of(key.fingerprint)}"


def _next(file: Path) -> list[str]:
    return [
        "copy it to each robot by a way that you trust, and install it there:",
        f"  sdrlinkctl key install {file}",
        "compare the words, then delete the copies",
    ]


def _say(*lines: str) -> None:
    console = Console(soft_wrap=True, highlight=False, markup=False)
    for line in lines:
        console.print(line)
