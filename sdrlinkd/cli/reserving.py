"""`set --reserve`: asks the team for air, and waits for its word."""

import re
import time
from typing import Any

import msgspec

from sdrlinkd.asking import ask_status
from sdrlinkd.client import ControlClient
from sdrlinkd.errors import UserError
from sdrlinkd.reports import AdmissionReport, ReservedFlowReport
from sdrlinkd.units import octets

_ASKED = re.compile(r"([0-9.]+)(?:hz)?:([0-9.]+[a-z]*)", re.IGNORECASE)
SETTLED_S, LONGEST_S, STEP_S = 1.0, 4.0, 0.1
"""Times in s: until a word counts, the longest wait for one, and between two looks."""


def asked_air(text: str) -> dict[str, Any]:
    """The keys of a policy that `--reserve` sets: `50:1KB` or `none`. Raises UserError."""
    if text == "none":
        return {"reserve": False}
    found = _ASKED.fullmatch(text.replace(" ", ""))
    try:
        rate_hz = float(found[1]) if found else 0.0
    except ValueError:
        rate_hz = 0.0
    if found is None or rate_hz <= 0:
        raise UserError(
            f"--reserve: got {text}; allowed: RATE:SIZE, such as 50:1KB (50 messages per second of "
            "1 KB at most), or none"
        )
    return {"reserve": True, "period_s": 1 / rate_hz, "max_bytes": octets(found[2], "--reserve")}


def answer_of_team(control: ControlClient, name: str) -> dict[str, Any]:
    """What the team says of the flow of this robot's topic; `flow` null: nothing yet."""
    began_s, report = time.monotonic(), AdmissionReport()
    flow: ReservedFlowReport | None = None
    while (passed_s := time.monotonic() - began_s) < LONGEST_S:
        snapshot = ask_status(control)
        report = snapshot.link.admission
        own = [each for each in report.flows if each.src == snapshot.node and each.name == name]
        flow = own[0] if own else None
        if flow is not None and flow.admitted is not None and passed_s > SETTLED_S:
            break
        time.sleep(STEP_S)
    return {"flow": msgspec.to_builtins(flow), "report": msgspec.to_builtins(report)}


def verdict_words(answer: dict[str, Any]) -> str:
    """The word of the team on a flow, in one sentence."""
    flow, report = answer["flow"], answer["report"]
    if flow is None:
        return (
            "nothing is reserved yet: the radio is down (sdrlinkctl status), or the configuration "
            "has admission.share = 0"
        )
    needs = f"{flow['air_pct']:.3g} % of the air over its route"
    of = f"{report['admitted_pct']:.3g} of {report['limit_pct']:.3g} % are taken"
    if flow["admitted"] is None:
        return f"robot {report['planner']} has not answered yet: it needs {needs}"
    if flow["admitted"]:
        return f"admitted by robot {report['planner']}: it has {needs}; {of}"
    return f"refused by robot {report['planner']}: it needs {needs}; {of}; its messages are dropped"
