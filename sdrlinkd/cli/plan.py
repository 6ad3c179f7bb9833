"""`plan`: predicts whether the traffic fits the channel, and advises what to change."""

import contextlib
from collections.abc import Mapping
from math import inf
from pathlib import Path
from typing import Annotated

import msgspec
import typer

from sdrlinkd.adapters import open_bag
from sdrlinkd.asking import snapshot_at
from sdrlinkd.cli.app import AsJson, RuntimeDir, app
from sdrlinkd.cli.team_plan import show_team
from sdrlinkd.config import Config, load_config, make_setup
from sdrlinkd.errors import UserError
from sdrlinkd.plan import (
    HOST_S,
    MOST_ROBOTS,
    AccessBound,
    LeftOut,
    Plan,
    bounds_of,
    loads_from_bag,
    make_plan,
    names_in,
    parse_load,
    setting_of,
    with_declared,
)
from sdrlinkd.tables import FittedTable, figure, screen_console, words
from sdrlinkd.units import metres_per_second, seconds

COLUMNS = (
    words("topic"), words("class", 6, 7), figure("Hz"), figure("bytes", 8), figure("PDUs", 7),
    figure("Mbit/s", 9), figure("air"), figure("turn", 2), figure("queue", 3), figure("bursts", 4),
    figure("rest", 5), figure("worst case"), figure("p99 now", 1),
)  # fmt: skip


NOTHING_YET = "–"
WAITS = (
    figure("robots"), words("policy"), words("the others have", 4, 11), figure("urgent"),
    figure("latency"), figure("default"), figure("bulk"),
)  # fmt: skip
NOTHING = "no topics to plan; give --bag FILE, or topics with --topic NAME:RATE:SIZE"


@app.command()
def plan(
    config: Annotated[
        Path | None, typer.Option("--config", help="The daemon's configuration.")
    ] = None,
    topic: Annotated[
        list[str] | None, typer.Option(help="NAME:RATE:SIZE, such as scan:50:1KB; repeatable.")
    ] = None,
    bag: Annotated[Path | None, typer.Option(help="Take rates and sizes from a recording.")] = None,
    robots: Annotated[
        str | None,
        typer.Option(
            help="Robots that each send this traffic, at most 32, or a range such as 1..32 for the "
            "waits for the air; default: access.nodes."
        ),
    ] = None,
    turnaround: Annotated[
        str | None,
        typer.Option(help="The radio's receive-to-transmit turnaround; default: as configured."),
    ] = None,
    speed: Annotated[
        str | None,
        typer.Option(
            help="How fast robots move past each other, such as 5m/s or 18km/h: it bounds bursts."
        ),
    ] = None,
    host: Annotated[
        str, typer.Option(help="Latency of the hosts; `sdrlinkctl doctor` measures it.")
    ] = f"{1e3 * HOST_S:g}ms",
    team: Annotated[
        bool, typer.Option("--team", help="The flows of a running team that reserve air.")
    ] = False,
    runtime_dir: RuntimeDir = None,
    as_json: AsJson = False,
) -> None:
    """Plan airtime and worst-case latency by topic; exit code 1 when the traffic does not fit.

    The worst case is the sum of turn, queue, bursts and rest; beside it, the p99 that a running
    daemon measures at messages of other robots. Without topics, the longest waits for the air are
    printed, by class, whatever other robots send.
    """
    if team:
        ignored = {
            "--topic": topic, "--bag": bag, "--robots": robots, "--turnaround": turnaround,
            "--speed": speed,
        }  # fmt: skip
        for option, value in ignored.items():
            if value:
                raise UserError(f"{option}: given with --team; allowed: only one of them")
        show_team(runtime_dir, config, as_json=as_json)
        return
    if config is None:
        raise UserError("--config: missing; allowed: a configuration, or --team")
    setup = make_setup(load_config(config), config.parent, str(config))
    turnaround_s = None if turnaround is None else seconds(turnaround, "--turnaround")
    host_s, has_numbers = seconds(host, "--host"), setup.has_numbers
    counts = None if robots is None else _counts(robots)
    n = counts[0] if counts is not None and len(counts) == 1 else None
    speed_m_s = 0.0 if speed is None else metres_per_second(speed, "--speed")
    setting = setting_of(
        setup.config, setup.node_id, n, turnaround_s, host_s, has_numbers, speed_m_s
    )
    bounds = list(setting.bounds)
    refused: list[str] = []
    if counts is not None and n is None:
        if topic or bag is not None:
            raise UserError(f"--robots: got {robots} with topics; allowed: one number of robots")
        bounds, refused = bounds_of(setup.config, setup.node_id, counts, turnaround_s)
        if not any(each.first_s < inf for each in bounds):
            raise UserError(
                f"--robots: got {robots}, but the access policy is {setting.settled.policy}, which "
                "has no longest wait; allowed: a configuration with robots in access.nodes, such "
                "as `sdrlinkctl init` writes"
            )
    registry, policies = setup.registry, setup.policies
    with contextlib.ExitStack() as stack:
        recording = None if bag is None else stack.enter_context(contextlib.closing(open_bag(bag)))
        if has_numbers:
            recorded = [] if recording is None else recording.topics()
            types = dict.fromkeys(names_in(topic or []), "")
            types |= {setup.name_on_air(each.name): each.type for each in recorded}
            registry, policies = with_declared(registry, setup.table, types)
        loads = [parse_load(text, registry) for text in topic or []]
        left_out: list[LeftOut] = []
        if recording is not None:
            told = {load.topic_id for load in loads}
            messages = (
                (each.topic, 1e-9 * each.time_ns, each.cdr) for each in recording.messages()
            )
            found, left_out = loads_from_bag(messages, registry, policies, setup.config.topics)
            loads += [load for load in found if load.topic_id not in told]
    if not loads and left_out:
        raise UserError(_nothing(left_out))
    made = make_plan(sorted(loads), policies, setting, left_out)
    # Of the same air, there is one worst case at a time.
    bounds = [] if made.topics else bounds
    made = made._replace(bounds=bounds, notes=[*made.notes, *refused])
    measured = _measured(runtime_dir or _directory(setup.config), setup.node_id)
    if as_json:
        topics = [
            {
                **each._asdict(), "is_late": each.is_late, "worst_s": each.worst_s,
                "worst": each.worst._asdict(), "p99_s": measured.get(each.name),
            }
            for each in made.topics
        ]  # fmt: skip
        classes = [each._asdict() for each in made.classes]
        left = [each._asdict() for each in made.left_out]
        waits = [each._asdict() for each in made.bounds]
        text = {
            **made._asdict(), "topics": topics, "classes": classes, "left_out": left,
            "bounds": waits,
        }  # fmt: skip
        typer.echo(msgspec.json.encode(text).decode())
    else:
        console = screen_console()
        for line in lines(made, measured):
            console.print(line, highlight=False)
    if not made.is_feasible:
        raise typer.Exit(1)


def _directory(config: Config) -> Path | None:
    """Where the sockets of a daemon with this configuration are."""
    return Path(config.bus.runtime_dir) if config.bus.runtime_dir else None


def _measured(directory: Path | None, node_id: int) -> dict[str, float]:
    """The p99 in s of messages of others at this robot's daemon, by topic: the largest one."""
    snapshot = snapshot_at(directory)
    found: dict[str, float] = {}
    if snapshot is None or snapshot.node != node_id:
        return found
    for each in snapshot.link.received:
        if each.age_ms_p99 is not None:
            found[each.name] = max(found.get(each.name, 0.0), 1e-3 * each.age_ms_p99)
    return found


def lines(made: Plan, measured: Mapping[str, float] = {}) -> list[FittedTable | str]:
    """The plan for the screen: the verdict, a table, advice and notes."""
    table = FittedTable("turn + queue + bursts + rest = worst case, in ms", COLUMNS)
    for each in made.topics:
        is_bounded = each.worst_s < inf
        parts = each.worst if is_bounded else (inf,) * 4
        table.add(
            each.name, each.qos, f"{each.rate_hz:.3g}", f"{each.size:.0f}", str(each.pdus),
            f"{each.rate_mbps:.3g}", f"{100 * each.air:.1f} %", *map(_ms, parts),
            f"{_ms(each.worst_s)} ms" if is_bounded else "unbounded",
            f"{_ms(measured[each.name])} ms" if each.name in measured else NOTHING_YET,
            style="bold red" if each.is_late or not is_bounded else "",
        )  # fmt: skip
    empty = [""] * (len(COLUMNS) - 7)
    for qos in made.classes:
        if qos.air:
            air = f"{100 * qos.air:.1f} %"
            table.add("", qos.qos, "", "", "", "", air, *empty, style="dim")
    all_of = "" if made.robots == 1 else f" by {made.robots} robots"
    if made.robots > 1 and made.policy == "none":
        all_of = f" by each of {made.robots} robots"
    verdict = "feasible" if made.is_feasible else "NOT feasible"
    if not made.topics:
        return [*_waits(made.bounds), NOTHING, *made.notes]
    asked = f"{100 * made.air:.3g} % of the channel's capacity requested{all_of}: {verdict}"
    left_out = [f"left out: {name} ({n} messages): {why}" for name, n, why in made.left_out]
    return [asked, *made.advice, table, *made.notes, *left_out]


def _ms(seconds_: float) -> str:
    return f"{1e3 * seconds_:.1f}" if seconds_ < inf else NOTHING_YET


def _waits(bounds: list[AccessBound]) -> list[FittedTable | str]:
    """The longest waits for the air as a table, if there are any."""
    found: dict[int, list[AccessBound]] = {}
    for each in bounds:
        if each.first_s < inf:
            found.setdefault(each.robots, []).append(each)
    if not found:
        return []
    table = FittedTable("longest wait for the air, whatever the others send", WAITS)
    for n, of in found.items():
        for others, waits_s in (
            ("less urgent", [each.first_s for each in of]),
            ("the same", [each.all_s for each in of]),
        ):
            cells = (f"{1e3 * each:.1f} ms" for each in waits_s)
            table.add(str(n), of[0].policy, others, *cells)
    return [table]


def _counts(text: str) -> list[int]:
    """Numbers of robots, given as `8` or `1..32`. Raises UserError."""
    parts = text.split("..")
    whole = [int(each) for each in parts if each.isdecimal()]
    if len(whole) != len(parts) or len(parts) > 2 or not 1 <= whole[0] <= whole[-1] <= MOST_ROBOTS:
        raise UserError(
            f"--robots: got {text}; allowed: 1 to {MOST_ROBOTS}, or a range such as "
            f"1..{MOST_ROBOTS}"
        )
    return list(range(whole[0], whole[-1] + 1))


def _nothing(left_out: list[LeftOut]) -> str:
    names = ", ".join(f"{each.name} ({each.why})" for each in left_out)
    return f"--bag: no topic in it can be planned: {names}; give topics with --topic NAME:RATE:SIZE"
