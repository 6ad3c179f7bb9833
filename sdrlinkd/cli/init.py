"""`init`: writes a first configuration and registry. Needs no daemon."""

import os
import tempfile
from errno import EISDIR
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from backends import BackendError, hub_at
from sdrlinkd.cli.app import RuntimeDir, app, connect
from sdrlinkd.cli.questions import Questions
from sdrlinkd.errors import UserError
from sdrlinkd.init import (
    KEYS,
    RADIOS,
    REGISTRY,
    Choice,
    FoundTopic,
    RadioPreset,
    Team,
    choose,
    copy_of,
    dictionaries_of,
    named,
    team_files,
    topics_of_graph,
)
from sdrlinkd.keyring import key_file_text, new_key

MOST_ROBOTS = 254


@app.command()
def init(
    radio: Annotated[
        str,
        typer.Option(help=", ".join(RADIOS), autocompletion=lambda: list(RADIOS)),
    ] = "",
    robots: Annotated[
        int | None,
        typer.Option(min=1, max=MOST_ROBOTS, help="Number of robots that share the channel."),
    ] = None,
    frequency: Annotated[
        str, typer.Option(metavar="HZ", help='Centre frequency, such as "433.92 MHz".')
    ] = "",
    own: Annotated[
        str, typer.Option("--id", help="Id of this robot, from 1; all: a file for each robot.")
    ] = "",
    topic: Annotated[
        list[str] | None,
        typer.Option(help="NAME:TYPE, or NAME with --bag or --from-graph; repeatable."),
    ] = None,
    bag: Annotated[Path | None, typer.Option(help="Take the topics from a recording.")] = None,
    from_graph: Annotated[
        bool, typer.Option("--from-graph", help="Take the topics from the running ROS 2 graph.")
    ] = False,
    from_daemon: Annotated[
        bool,
        typer.Option("--from-daemon", help="Copy the running daemon's files for another --id."),
    ] = False,
    device: Annotated[
        str, typer.Option(metavar="ARGS", help='Value of soapy.device, such as "driver=hackrf".')
    ] = "",
    hub: Annotated[
        str,
        typer.Option(
            metavar="HOST:PORT",
            help="With --radio ether: one computer a robot; this is the hub's address.",
        ),
    ] = "",
    seal: Annotated[
        bool | None,
        typer.Option("--seal/--clear", help="Make a key, so that only the team can send and read."),
    ] = None,
    out: Annotated[Path, typer.Option(help="Folder to write to.")] = Path(),
    force: Annotated[bool, typer.Option("--force", help="Replace existing files.")] = False,
    runtime_dir: RuntimeDir = None,
) -> None:
    """Write a first configuration and registry.

    On a terminal, init asks for what the options leave open.
    """
    questions = Questions()
    if from_daemon:
        files = _copied(questions, own, runtime_dir)
    else:
        preset = questions.radio(radio)
        count = questions.robots(robots) if preset.shares_air else 1
        frequency = questions.frequency(frequency) if preset.is_real else ""
        device = questions.device(device, preset) if preset.is_real else ""
        ids = questions.own_ids(own, count)
        found = _topics(questions, topic or [], bag, from_graph=from_graph)
        if hub:
            _check_hub(hub, preset)
        air, sockets = (out / "air").absolute(), _socket_folder()
        is_sealed = preset.shares_air and questions.is_sealed(seal)
        team = Team(preset, count, frequency, device, found, air, sockets, hub, is_sealed)
        files = {name: text.encode() for name, text in team_files(team, ids).items()}
        if is_sealed:
            files[KEYS] = key_file_text(new_key(0)).encode()
    _write(files, out, force)
    console = Console(soft_wrap=True, highlight=False, markup=False)
    console.print(f"wrote {', '.join(str(out / name) for name in files)}")
    for line in _next(files, out, None if from_daemon else preset, hub):
        console.print(line)


def _check_hub(hub: str, preset: RadioPreset) -> None:
    if preset.backend != "ether":
        raise UserError(f"--hub: got {hub}; allowed with --radio ether only")
    try:
        hub_at(hub, "--hub")
    except BackendError as error:
        raise UserError(str(error)) from None


def _topics(
    questions: Questions, wanted: list[str], bag: Path | None, *, from_graph: bool
) -> list[FoundTopic]:
    if bag is not None and from_graph:
        raise UserError("--bag, --from-graph: both given; allowed: one of them")
    if bag is None and not from_graph:
        if wanted:
            return named(wanted)
        answer = questions.topics()
        if answer == ["graph"]:
            from_graph = True
        elif len(answer) == 1 and ":" not in answer[0]:
            bag = Path(answer[0])
        else:
            return named(answer)
    choice = (
        choose(topics_of_graph(), wanted, "the ROS 2 graph")
        if bag is None
        else choose(_topics_of(bag), wanted, str(bag))
    )
    _tell(choice)
    return choice.taken


def _topics_of(bag: Path) -> list[FoundTopic]:
    # This imports the message types, which are slow to load.
    from sdrlinkd.adapters import open_bag

    opened = open_bag(bag)
    try:
        return [FoundTopic(*each[:3]) for each in opened.topics()]
    finally:
        opened.close()


def _tell(choice: Choice) -> None:
    console = Console(stderr=True, soft_wrap=True, highlight=False, markup=False)
    for name, reason in choice.left_out.items():
        console.print(f"left out: {name} ({reason})", style="yellow")
    if any(reason.startswith("no room") for reason in choice.left_out.values()):
        console.print("select topics with --topic NAME, repeatable", style="yellow")


def _copied(questions: Questions, own: str, runtime_dir: Path | None) -> dict[str, bytes]:
    from sdrlinkd.config import typed_config

    with connect(runtime_dir) as control:
        config = typed_config(control.ask("config"))
        topics = control.ask("topics")
        own_id = control.ask("hello")["node"]
    ids = questions.own_ids(own, MOST_ROBOTS)
    if len(ids) > 1:
        raise UserError('--id: got "all"; allowed with --from-daemon: one robot')
    prefix = f"/{config.namespace.strip('/')}/" if config.namespace else "/"
    lines = "".join(f"{each['name'].removeprefix(prefix)},{each['type']}\n" for each in topics)
    registry = "# Topic registry: all robots need the same file.\n" + lines
    return {
        REGISTRY: registry.encode(),
        "sdrlinkd.toml": copy_of(config, own_id, ids[0]).encode(),
        **dictionaries_of(config),
    }


def _socket_folder() -> Path:
    own = os.environ.get("XDG_RUNTIME_DIR")
    return Path(own, "sdrlinkd") if own else Path(tempfile.gettempdir(), f"sdrlinkd-{os.getuid()}")


def _write(files: dict[str, bytes], out: Path, force: bool) -> None:
    """Write all files or none. Raises UserError."""
    there = [name for name in files if (out / name).exists()]
    if there and not force:
        names = ", ".join(str(out / name) for name in there)
        raise UserError(f"{names}: already there; allowed: another --out, or --force to replace")
    _try_out(files, out)
    try:
        out.mkdir(parents=True, exist_ok=True)
        for name in files:
            if (out / name).is_dir():
                raise IsADirectoryError(EISDIR, "it is a directory", str(out / name))
        # On the same file system, so that they only have to be renamed.
        with tempfile.TemporaryDirectory(dir=out, prefix=".init-") as aside:
            for name, content in files.items():
                (Path(aside) / name).write_bytes(content)
                if name == KEYS:
                    (Path(aside) / name).chmod(0o600)
            for name in files:
                (Path(aside) / name).replace(out / name)
    except OSError as error:
        raise UserError(f"{error.filename or out} cannot be written ({error.strerror})") from None


def _try_out(files: dict[str, bytes], out: Path) -> None:
    """Check that a daemon accepts the files. Raises UserError."""
    from sdrlinkd.config import make_setup, parse_config

    with tempfile.TemporaryDirectory() as trial:
        for name, content in files.items():
            (Path(trial) / name).write_bytes(content)
        for name in files:
            if name.endswith(".toml") and name != KEYS:
                make_setup(parse_config(files[name].decode(), str(out / name)), Path(trial))


def _next(files: dict[str, bytes], out: Path, preset: RadioPreset | None, hub: str) -> list[str]:
    """Lines on what to type next; `preset` is None if the kind of radio is unknown."""
    configs = [out / name for name in files if name.endswith(".toml") and name != KEYS]
    is_real = preset is not None and preset.is_real
    is_here = len(configs) > 1 and not is_real and not hub
    lines, here = ["next:"], configs[: None if is_here else 1]
    if KEYS in files:
        lines += [f"  sdrlinkctl key install --new --config {each}" for each in here]
    lines.append(f"  sdrlinkd --check --config {configs[0]}")
    if is_real:
        lines += [
            f"  sdrlinkctl doctor --config {configs[0]}",
            "  put 60 dB of attenuation between the radios; then set tx_enabled = true in the file",
        ]
    if preset is not None and preset.backend == "ether":
        where = f"--listen 0.0.0.0:{hub.rpartition(':')[2]}" if hub else f"--dir {out / 'air'}"
        lines.append(f"  sdrlink-ether {where} &")
    behind = " &" if is_here else ""
    lines += [f"  sdrlinkd --config {each}{behind}" for each in here]
    if len(configs) > 1 and not is_here:
        rest = ", ".join(each.name for each in configs[1:])
        which = rest if len(configs) == 2 else f"one of {rest}"
        to = "the other robot" if len(configs) == 2 else "each other robot"
        what = f"{REGISTRY}, {KEYS} (secret)" if KEYS in files else REGISTRY
        lines.append(f"  copy {what} and {which} to {to}")
    elif len(configs) == 1 and (preset is None or preset.shares_air):
        what = f"{REGISTRY} and {KEYS} (secret)" if KEYS in files else REGISTRY
        lines.append(f"  each other robot needs the same {what}, and its own --id")
    return lines
