"""`plan`: predicts whether the traffic fits the channel, and advises what to change."""

import contextlib
from pathlib import Path
from typing import Annotated

import msgspec
import typer

from sdrlinkd.adapters import open_bag
from sdrlinkd.cli.app import AsJson, RuntimeDir, app
from sdrlinkd.cli.team_plan import show_team
from sdrlinkd.config import load_config, make_setup
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
    words("topic"), words("class", 4, 7), figure("Hz"), figure("bytes", 2), figure("PDUs", 1),
    figure("Mbit/s", 3), figure("air"), figure("worst case"),
)  # fmt: skip


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

    Without topics, only the longest waits for the air are printed, by class.
    """
    if team:
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
        bounds, refused = bounds_of(setup.config, setup.node_id, counts, turnaround_s)
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
    made = made._replace(bounds=bounds, notes=[*made.notes, *refused])
    if as_json:
        topics = [{**each._asdict(), "is_late": each.is_late} for each in made.topics]
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
        for line in lines(made):
            console.print(line, highlight=False)
    if not made.is_feasible:
        raise typer.Exit(1)


def lines(made: Plan) -> list[FittedTable | str]:
    """The plan for the screen: a table, the verdict, advice and notes."""
    table = FittedTable("plan", COLUMNS)
    for each in made.topics:
        worst = f"{1e3 * each.worst_s:.1f} ms" if each.worst_s < float("inf") else "unbounded"
        table.add(
            each.name, each.qos, f"{each.rate_hz:.3g}", f"{each.size:.0f}", str(each.pdus),
            f"{each.rate_mbps:.3g}", f"{100 * each.air:.1f} %", worst,
            style="bold red" if each.is_late or each.worst_s == float("inf") else "",
        )  # fmt: skip
    for qos in made.classes:
        if qos.air:
            table.add("", qos.qos, "", "", "", "", f"{100 * qos.air:.1f} %", "", style="dim")
    all_of = "" if made.robots == 1 else f" by {made.robots} robots"
    if made.robots > 1 and made.policy == "none":
        all_of = f" by each of {made.robots} robots"
    verdict = "feasible" if made.is_feasible else "NOT feasible"
    if not made.topics:
        return [*_waits(made.bounds), NOTHING, *made.notes]
    asked = f"{100 * made.air:.3g} % of the channel's capacity requested{all_of}: {verdict}"
    left_out = [f"left out: {name} ({n} messages): {why}" for name, n, why in made.left_out]
    return [table, asked, *made.advice, *_waits(made.bounds), *made.notes, *left_out]


def _waits(bounds: list[AccessBound]) -> list[FittedTable | str]:
    """The longest waits for the air as a table, if there are any."""
    found: dict[int, list[AccessBound]] = {}
    for each in bounds:
        if each.first_s < float("inf"):
            found.setdefault(each.robots, []).append(each)
    if not found:
        return []
    table = FittedTable("longest wait for the air", WAITS)
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
