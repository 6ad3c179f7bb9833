"""`key`: keys of a team, which seal its PDUs."""

import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from msgspec import structs
from rich.console import Console

from sdrlinkd.cli.app import RuntimeDir, app, connect
from sdrlinkd.cli.completion import robot_names
from sdrlinkd.client import NoDaemonError
from sdrlinkd.errors import UserError

if TYPE_CHECKING:
    from sdrlinkd.config import Setup
    from sdrlinkd.keyring import KeyFile, KeyState, StoredKey
    from sdrlinkd.reports import SecurityReport, Snapshot

DEFAULT_CONFIG = Path("/etc/sdrlinkd/sdrlinkd.toml")
KEY_FILE, NEXT_FILE = Path("team.key"), Path("next.key")
STDIN = Path("-")
CERTIFICATES = Path("certificates")

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
    from sdrlinkd.keyring import new_key

    _create(file, new_key(0))


@key_app.command()
def rotate(
    file: Annotated[Path, typer.Argument(help="File to write.", metavar="FILE")] = NEXT_FILE,
    config: ConfigFile = DEFAULT_CONFIG,
) -> None:
    """Make the next key of a team, from which a lost robot is left out."""
    from sdrlinkd.keyring import new_key
    from sdrlinkd.wire import N_KIDS

    held = _held(Path(_setup(config).config.security.keys))
    _create(file, new_key((held.key[-1].kid + 1) % N_KIDS, follows=True))
    _say(
        "each robot changes to it once all robots that it hears have it, or after 10 minutes; the "
        "old key opens for 10 more minutes at most"
    )
    if held.pair:
        _say("the keys of pairs are not renewed: add new ones to the file, as [[pair]]")


@key_app.command()
def install(
    file: Annotated[
        Path | None,
        typer.Argument(help="File with the key; -: stdin; absent: the robot's own key file."),
    ] = None,
    config: ConfigFile = DEFAULT_CONFIG,
    new: Annotated[
        bool, typer.Option("--new", help="This robot's id has never sealed with it, on any disk.")
    ] = False,
    replace: Annotated[
        bool, typer.Option("--replace", help="Use the new key in place of all others, at once.")
    ] = False,
    copy: Annotated[
        bool,
        typer.Option(
            "--copy/--no-copy",
            help="Whether to write it to the robot's key file; not if it is a systemd credential.",
        ),
    ] = True,
) -> None:
    """Install a key on this robot: beside the one in use, to which the robots then change."""
    from sdrlinkd.keyring import check_number, write_key_file

    setup = _setup(config)
    path, state = Path(setup.config.security.keys), _state(setup)
    owner = _owner(state.directory)
    state.check()
    given = _given(path if file is None else file)
    installed = _held(path) if copy and path.exists() else None
    keys = given if replace or installed is None else _merged(installed, given, state, path)
    check_number(keys, str(path))
    keys = structs.replace(keys, key=[_with_robots(key, installed) for key in keys.key])
    if new:
        _check_new(keys, state, setup.node_id)
    # A credential does not tell on which robots a key was used.
    is_new = new or (copy and state.is_whole)
    begun = [_begun(key, state, setup.node_id, owner, is_new) for key in keys.key]
    if copy:
        write_key_file(path, structs.replace(keys, key=begun), owner)
    _say(*(f"installed: {_told(key)}" for key in given.key))
    lost = [key.kid for key in keys.key if not state.knows(key.key)]
    if lost:
        _say(_about_lost(lost))
    if setup.config.security.mode == "off":
        _say(f'nothing is sealed yet: set mode = "seal" in [security] of {config}, at all robots')
        return
    _say(_reloaded(setup))


@key_app.command()
def certificates(
    names: Annotated[
        list[str],
        typer.Argument(help="A name for each gateway, and for each operator.", metavar="NAME…"),
    ],
    folder: Annotated[
        Path, typer.Option("--folder", help="Folder to write to.", metavar="FOLDER")
    ] = CERTIFICATES,
    days: Annotated[
        int, typer.Option("--days", help="Days for which they count.", min=1, max=3650)
    ] = 730,
) -> None:
    """Make certificates, by which gateways and operators know each other over an IP network."""
    from sdrlinkd.keyring import make_certificates

    for path in make_certificates(folder, names, days):
        _say(f"wrote {path}")
    _say(
        'copy each file to its computer alone, and name it there in [fleet]: zenoh = "NAME.json5"',
        f"keep {folder} where nobody can read it: it is needed to make more",
    )


@key_app.command()
def show(
    file: Annotated[
        Path | None, typer.Argument(help="File with keys; absent: the robot's own key file.")
    ] = None,
    config: ConfigFile = DEFAULT_CONFIG,
) -> None:
    """Show the keys as words, to compare them with those of another robot."""
    if file is not None:
        _say(*map(_told, _held(file).key))
        return
    setup = _setup(config)
    keys = _held(Path(setup.config.security.keys)).key
    found = _state(setup).load([key.key for key in keys])
    for key in keys:
        more = " (in use)" if key.fingerprint == found.in_use else ""
        more = " (replaced, does not open any more)" if key.fingerprint in found.retired else more
        _say(_told(key) + more)


@key_app.command()
def check(
    robot: Annotated[
        int, typer.Option("--with", help="Robot to check.", autocompletion=robot_names)
    ],
    runtime_dir: RuntimeDir = None,
) -> None:
    """Check whether another robot has the running daemon's key; exit code 1 if it has not."""
    from sdrlinkd.asking import ask_status
    from sdrlinkd.sealing import words_of

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


def _create(file: Path, keys: "KeyFile") -> None:
    from sdrlinkd.keyring import create_key_file

    create_key_file(file, keys)
    _say(
        f"wrote {file}, which only you can read",
        *map(_told, keys.key),
        "copy it to each robot by a way that you trust, and install it there:",
        f"  sdrlinkctl key install {file}",
        "compare the words, then delete the copies",
    )


def _given(file: Path) -> "KeyFile":
    from sdrlinkd.keyring import parse_key_file

    if file == STDIN:
        return parse_key_file(sys.stdin.buffer.read(), "stdin")
    return _held(file)


def _held(path: Path) -> "KeyFile":
    from sdrlinkd.keyring import read_key_file

    return read_key_file(path)


def _merged(installed: "KeyFile", given: "KeyFile", state: "KeyState", path: Path) -> "KeyFile":
    """The keys to hold: the one in use, and the next one. Raises UserError."""
    known = {each.fingerprint for each in installed.key}
    fresh = [key for key in given.key if key.fingerprint not in known]
    for key in fresh:
        if any(each.kid == key.kid for each in installed.key):
            raise UserError(
                f"{path}: another key with kid {key.kid} is installed; allowed: the next key, made "
                "with sdrlinkctl key rotate, or --replace"
            )
    kept = installed.key
    if fresh and len(kept) > 1:
        in_use = state.load([each.key for each in kept]).in_use
        kept = [each for each in kept if each.fingerprint == in_use] or kept[-1:]
    keys = [*kept, *fresh]
    pairs = {(each.kid, *sorted(each.robots)): each for each in (*installed.pair, *given.pair)}
    kids = {key.kid for key in keys}
    return structs.replace(
        installed, key=keys, pair=[each for each in pairs.values() if each.kid in kids]
    )


def _with_robots(key: "StoredKey", installed: "KeyFile | None") -> "StoredKey":
    """A key with the robots on which it was used, as far as the installed file tells, too."""
    before = installed.key if installed is not None else ()
    robots = [each.robots for each in before if each.fingerprint == key.fingerprint]
    return structs.replace(key, robots=sorted({*key.robots, *(robots[0] if robots else ())}))


def _check_new(keys: "KeyFile", state: "KeyState", robot: int) -> None:
    """Check that nothing here tells that the robot used a key. Raises UserError."""
    for key in keys.key:
        was_used = robot in key.robots or state.has_file(key.key)
        if was_used and not state.knows(key.key):
            raise UserError(
                f"--new: robot {robot} has used key {key.kid}, and its numbers in "
                f"{state.directory} are lost; allowed: install it without --new, or make the next "
                "key: sdrlinkctl key rotate"
            )


def _begun(
    key: "StoredKey",
    state: "KeyState",
    robot: int,
    owner: tuple[int, int] | None,
    is_new: bool,
) -> "StoredKey":
    """The key, whose numbers begin on this robot if it is new here."""
    if is_new and robot not in key.robots and not state.has_file(key.key):
        state.begin(key.key, owner)
    return structs.replace(key, robots=sorted({*key.robots, robot}))


def _about_lost(kids: list[int]) -> str:
    which = f"key {kids[0]}" if len(kids) == 1 else f"keys {kids[0]} and {kids[1]}"
    return (
        f"the numbers of {which} are not here, so this robot may have used any: before it seals, "
        "the daemon finds out from its clock and from the other robots. If its id never sealed "
        "with the key, say --new"
    )


def _owner(directory: Path) -> tuple[int, int] | None:
    """Who shall own what root writes: the owner of the state directory. Raises UserError."""
    if os.geteuid() != 0:
        return None
    if directory.is_relative_to("/var/lib") and not directory.exists():
        raise UserError(
            f"{directory}: not there yet, so it is not known which user the daemon has; start the "
            f"service once, or: install -d -m 750 -o sdrlink -g sdrlink {directory}"
        )
    return (about.st_uid, about.st_gid) if (about := _about(directory)) is not None else None


def _about(directory: Path) -> os.stat_result | None:
    try:
        return directory.stat()
    except OSError:
        return None


def _reloaded(setup: "Setup") -> str:
    """Make the running daemon take the keys; returns what happened."""
    given = setup.config.bus.runtime_dir
    try:
        with connect(Path(given) if given else None) as control:
            if control.ask("hello")["node"] != setup.node_id:
                return "the daemon that runs here is another robot's: reload this robot's daemon"
            told = control.ask("reload")["reloaded"]
            if "keys" not in told and not control.ask("status")["link"]["security"]["fingerprint"]:
                return "the daemon that runs does not seal: restart it"
            return f"the daemon has re-read: {told}"
    except NoDaemonError:
        return "no daemon runs; it takes the key when it starts"


def _told(key: "StoredKey") -> str:
    from sdrlinkd.sealing import words_of

    made = f", made {key.made_on}" if key.created else ""
    return f"key {key.kid}{made}: {words_of(key.fingerprint)}"


def _say(*lines: str) -> None:
    console = Console(soft_wrap=True, highlight=False, markup=False)
    for line in lines:
        console.print(line)
