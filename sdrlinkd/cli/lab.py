"""`lab`: runs a scenario with real daemons on one simulated air."""

import time
from contextlib import ExitStack
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import msgspec
import typer
from rich.live import Live
from rich.text import Text

from sdrlinkd.cli.app import app
from sdrlinkd.cli.compiling import compile_first
from sdrlinkd.cli.drive import PAGE, write_page
from sdrlinkd.cli.output import REPORT, load_pictures, make_folder, write_report
from sdrlinkd.cli.pace import MAX_SEED, Pace, chosen_scenario, scenario_names
from sdrlinkd.cli.page_beside import page_beside
from sdrlinkd.drive import DRIVE, RunDrive
from sdrlinkd.extras import lacking
from sdrlinkd.lab import (
    LabOptions,
    LabReport,
    LabState,
    find_scenario,
    live_table,
    pair_table,
    run_lab,
)
from sdrlinkd.tables import screen_console

PICTURE = "lab.png"


class Policy(StrEnum):
    """How the robots share the channel."""

    NONE = "none"
    CSMA = "csma"
    MINISLOT = "minislot"
    AUCTION = "auction"
    TDMA = "tdma"
    GRANT = "grant"


@app.command()
def lab(
    scenario: Annotated[
        Path,
        typer.Argument(
            help="Scenario: a file, or the name of a shipped one, such as two-robots.",
            autocompletion=scenario_names,
        ),
    ],
    bag: Annotated[
        Path | None,
        typer.Option(help="Recording that the robots send; default: a built-in robot's messages."),
    ] = None,
    traces: Annotated[
        Path | None, typer.Option(help="Folder of the logs whose outages a scenario replays.")
    ] = None,
    duration: Annotated[
        float | None, typer.Option(min=0.5, max=1e5, help="Seconds of traffic.")
    ] = None,
    pace: Annotated[
        Pace | None,
        typer.Option(help="In real time, or in lock-step, where a seed repeats exactly."),
    ] = None,
    seed: Annotated[int | None, typer.Option(min=0, max=MAX_SEED, help="Random seed.")] = None,
    access: Annotated[
        Policy | None, typer.Option(help="Access policy; default: that of the scenario.")
    ] = None,
    web: Annotated[
        bool, typer.Option("--web", help="Serve the page of the daemons while they run.")
    ] = False,
    out: Annotated[Path, typer.Option(help="Folder for reports, lab.png and the drive.")] = Path(
        "build/lab"
    ),
) -> None:
    """Run several robots' daemons on one simulated channel; measure the delivery of each pair."""
    console = screen_console()
    scenario = find_scenario(scenario)
    chosen = chosen_scenario(scenario, seed, duration, pace)
    if access is not None:
        section = {**chosen.daemon.get("access", {}), "policy": access.value, "force": True}
        chosen = msgspec.structs.replace(chosen, daemon={**chosen.daemon, "access": section})
    if bag is None and chosen.bag:
        bag = scenario.parent / chosen.bag
    no_pictures = lacking("plots")
    make_folder(out, [] if no_pictures else [PICTURE])
    options = LabOptions(scenario, chosen, bag, traces)
    title = chosen.title or scenario.stem
    compile_first(console)
    began = time.monotonic()
    with (
        ExitStack() as stack,
        Live(console=console, auto_refresh=False, transient=True) as live,
    ):
        starting = f"starting the hub and {len(chosen.robot)} robots"
        if console.is_terminal:
            live.update(Text(starting), refresh=True)
        else:
            console.print(starting, highlight=False)
        told: list[str] = []
        kept = RunDrive(out, time.time_ns())
        stack.callback(kept.close)

        def watch(state: LabState) -> None:
            kept.see(state.snapshots, state.now_s)
            if state.snapshots and not told:
                # Only once the daemons answer.
                told.extend(each.bus.runtime_dir for each in state.snapshots)
                others = "".join(f", {Path(each).name}" for each in told[1:])
                hint = f"inspect one: sdrlinkctl latency --runtime-dir {told[0]}{others}"
                console.print(hint, highlight=False, markup=False, soft_wrap=True)
                if web:
                    line = stack.enter_context(page_beside(map(Path, told)))
                    console.print(line, highlight=False, markup=False, soft_wrap=True)
            if console.is_terminal:
                live.update(live_table(title, state), refresh=True)

        report = run_lab(options, watch, kept.passed)
    write_report(out / REPORT, report)
    wall_s = time.monotonic() - began
    console.print(pair_table(report))
    for line in _summary(report, wall_s):
        console.print(line, highlight=False, markup=False, soft_wrap=True)
    made = [REPORT, DRIVE]
    if not no_pictures:
        made = [REPORT, PICTURE, DRIVE, PAGE]
        pictures = load_pictures("sdrlinkd.lab")
        pictures.draw(report, chosen, out / PICTURE, _caption(report, scenario))
        write_page(out, title)
    for line in filter(None, (f"wrote {out}/{', '.join(made)}", no_pictures)):
        console.print(line, highlight=False, markup=False, soft_wrap=True)
    if not all(robot.ledger_adds_up for robot in report.robots):
        raise typer.Exit(1)


def _summary(report: LabReport, wall_s: float) -> list[str]:
    pace = "in real time" if report.pace == "realtime" else "in lock-step"
    lines = [
        f"PDR {report.pdr:.4f} in all, {report.worst_pdr:.4f} at worst; {pace}, took {wall_s:.0f} s"
    ]
    if report.out_of_reach:
        pairs = ", ".join(f"{sender} → {receiver}" for sender, receiver in report.out_of_reach)
        lines.append(f"never in range of each other, and excluded from all figures: {pairs}")
    for robot in report.robots:
        text = (
            f"robot {robot.id}: {robot.access}; {100 * robot.airtime_share:.1f} % of the air, "
            f"{robot.bursts_sent} bursts, {robot.bursts_failed} failed, {robot.bursts_late} late "
            f"and resent; {robot.pdus_bad} PDUs and {robot.headers_bad} headers bad; "
            f"dropped: {robot.dropped or 'nothing'}"
        )
        if robot.left:
            text += f"; {robot.left} messages unsent"
        if robot.samples_lost:
            text += f"; CPU too slow: {robot.samples_lost} samples dropped"
        if not robot.ledger_adds_up:
            text += "; THE LEDGER DOES NOT ADD UP"
        lines.append(text)
    return lines


def _caption(report: LabReport, scenario: Path) -> str:
    return (
        f"sdrlinkctl lab {scenario.name}, {report.source}, {report.duration_s:g} s, "
        f"{report.pace}, seed {report.seed}; {report.robots[0].access}"
    )
