"""`plan --team`: shows the flows of a running team that reserve air, and who has it."""

from math import inf
from pathlib import Path

import msgspec
import typer

from sdrlinkd.asking import ask_status
from sdrlinkd.cli.app import connect
from sdrlinkd.cli.screens import team_screen
from sdrlinkd.config import load_config, make_setup
from sdrlinkd.plan import HOST_S, setting_of, team_worst_s
from sdrlinkd.reports import AdmissionReport
from sdrlinkd.tables import screen_console

WITHOUT_CONFIG = "worst cases: with --config, the daemon's configuration"
ASSUMED = (
    "worst cases: if all robots send what the flow's source sends, and relays add as much a hop"
)


def show_team(runtime_dir: Path | None, config: Path | None, *, as_json: bool) -> None:
    """Show the flows of the team; exit code 1 if one of them is refused."""
    with connect(runtime_dir) as control:
        snapshot = ask_status(control)
    report = snapshot.link.admission
    worst_s = None if config is None else _worst_s(config, report)
    if as_json:
        typer.echo(msgspec.json.encode(_told(report, worst_s or {})).decode())
    else:
        console = screen_console()
        for part in team_screen(snapshot.node, report, worst_s):
            console.print(part)
        if report.flows:
            console.print(WITHOUT_CONFIG if worst_s is None else ASSUMED, highlight=False)
    if any(flow.admitted is False for flow in report.flows):
        raise typer.Exit(1)


def _worst_s(config: Path, report: AdmissionReport) -> dict[tuple[int, int], float]:
    setup = make_setup(load_config(config), config.parent, str(config))
    setting = setting_of(setup.config, setup.node_id, None, None, HOST_S, setup.has_numbers)
    return dict(team_worst_s(report.flows, setting))


def _told(report: AdmissionReport, worst_s: dict[tuple[int, int], float]) -> object:
    """The report, with `worst_s` of each flow; null: not known, or without a bound."""
    flows = []
    for flow in report.flows:
        longest_s = worst_s.get((flow.src, flow.topic_id), inf)
        told = longest_s if longest_s < inf else None
        flows.append({**msgspec.to_builtins(flow), "worst_s": told})
    return {**msgspec.to_builtins(report), "flows": flows}
