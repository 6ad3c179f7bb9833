"""Writes the Grafana dashboards of the metrics, etc/grafana: `make reference`."""

import sys
from pathlib import Path

from grafana_foundation_sdk.builders.dashboard import Dashboard, Row

from docs.site.panels import (
    ALERTS,
    AMBER,
    GREEN,
    RED,
    THIRD,
    Column,
    Steps,
    Words,
    board,
    by_robot,
    choice,
    figure,
    graph,
    query,
    states,
    text_of,
)

FOLDER = Path(__file__).parents[2] / "etc/grafana"
ROBOT, FLEET = "sdrlink-robot", "sdrlink-fleet"
LOST_S = 10
"""As in the alert SdrlinkRobotLost."""

VERDICTS: Words = {0: ("OK", GREEN), 1: ("DEGRADED", AMBER), 2: ("DOWN", RED)}
SEALS: Words = {0: ("in the clear", AMBER), 1: ("authenticated", GREEN), 2: ("sealed", GREEN)}
PRESENCE: Words = {0: ("gone", RED), 1: ("up", GREEN)}
GOOD_SNR: Steps = [(None, RED), (6.0, AMBER), (12.0, GREEN)]
LITTLE_LOSS: Steps = [(None, GREEN), (0.05, AMBER), (0.2, RED)]
MUCH_PDR: Steps = [(None, RED), (0.9, AMBER), (0.99, GREEN)]
FREE_AIR: Steps = [(None, GREEN), (0.7, AMBER), (0.9, RED)]
NONE_LOST: Steps = [(None, GREEN), (1.0, RED)]

RATE = "[$__rate_interval]"
ONE = '{node="$node"}'
OTHERS = "unless on (node, robot) (sdrlink_neighbor_is_self == 1)"
"""Leaves out a robot that hears itself."""


def verdict(labels: str = "") -> str:
    """The verdict as a number, with the words VERDICTS, of each robot that `labels` choose."""
    return _level("sdrlink_verdict_level", labels, "DEGRADED", "DOWN")


def seal(labels: str = "") -> str:
    """What is sealed as a number, with the words SEALS."""
    return _level("sdrlink_security_mode", labels, "auth", "seal")


def _level(metric: str, labels: str, one: str, two: str) -> str:
    return (
        f'sum by (node) ({metric}{{{labels}{metric}="{one}"}} '
        f'or 2 * {metric}{{{labels}{metric}="{two}"}})'
    )


def robot() -> Dashboard:
    """The dashboard of one robot's link."""
    of_node = 'node="$node", '
    made = board("sdrlink: one robot", ROBOT, "The link of one robot: sdrlinkctl status over time.")
    made.with_variable(choice("node", "Robot", "label_values(sdrlink_uptime_seconds, node)"))
    air = f"sdrlink_air_sent_ratio{ONE} + sdrlink_air_heard_ratio{ONE}"
    lost = f"sum(sdrlink_neighbor_last_heard_age_seconds{ONE} > bool {LOST_S}) or vector(0)"
    for panel in (
        figure("Verdict", "What `sdrlinkctl status` says; it gives the reasons, too.", "short",
               query(verdict(of_node)), words=VERDICTS),
        figure("Robots lost", f"Robots not heard for {LOST_S} s.", "short", query(lost),
               steps=NONE_LOST),
        figure("Air in use", "Airtime of our bursts and of those heard.", "percentunit",
               query(air), steps=FREE_AIR),
        figure("Waiting", "Messages in the queue.", "short", query(f"sdrlink_tx_queued{ONE}")),
        figure("Sealing", "What is sealed.", "short", query(seal(of_node)), words=SEALS),
        figure("Uptime", "Since the daemon's start.", "dtdurations",
               query(f"sdrlink_uptime_seconds{ONE}")),
    ):  # fmt: skip
        made.with_panel(panel)
    made.with_panel(
        states("Verdict over time", "OK, DEGRADED or DOWN.", VERDICTS,
               query(verdict(of_node), "verdict"))
    )  # fmt: skip
    return _ages(_queue(_air(_neighbors(made))))


def _neighbors(made: Dashboard) -> Dashboard:
    def of(name: str) -> str:
        return f"sdrlink_neighbor_{name}{ONE} {OTHERS}"

    made.with_row(Row("Neighbors"))
    made.with_panel(
        graph("SNR", "Here, and there by the neighbor's report.", "dB",
              query(of("snr_db"), "of {{robot}} here"),
              query(of("snr_there_db"), "of us at {{robot}}"), span=THIRD, least=None)
    ).with_panel(
        graph("Loss", "Share of PDUs lost: here in the last 5 s, there by its report.",
              "percentunit", query(of("lately_loss_ratio"), "from {{robot}}"),
              query(of("there_loss_ratio"), "to {{robot}}"), span=THIRD)
    ).with_panel(
        graph("MCS", "With which we send default and bulk traffic to each neighbor.", "short",
              query(of("mcs"), "to {{robot}}"), span=THIRD)
    ).with_panel(
        graph("Last heard", f"Time since the last PDU; lost from {LOST_S} s on.", "s",
              query(of("last_heard_age_seconds"), "{{robot}}"), span=THIRD)
    ).with_panel(
        graph("Bound of the clock", "Largest error of what is known of a neighbor's clock.", "s",
              query(of("clock_bound_seconds"), "{{robot}}: clock of the link"),
              query(of("clock_wall_bound_seconds"), "{{robot}}: clock of the host"), span=THIRD)
    ).with_panel(
        graph("Clock known", "1 for the state in force.", "short",
              query(f"({of('clock_state')}) == 1", "{{robot}}: {{sdrlink_neighbor_clock_state}}"),
              span=THIRD)
    )  # fmt: skip
    return made


def _air(made: Dashboard) -> Dashboard:
    made.with_row(Row("Air"))
    made.with_panel(
        graph("Airtime by class", "Share of the time, by the class of the PDUs.", "percentunit",
              query(f"rate(sdrlink_airtime_by_class_seconds_total{ONE}{RATE})", "{{class}}"),
              query(f"rate(sdrlink_control_airtime_seconds_total{ONE}{RATE})", "control only"),
              span=THIRD, stacked=True)
    ).with_panel(
        graph("Air sent and heard", "Airtime of our bursts and of those heard.", "percentunit",
              query(f"sdrlink_air_sent_ratio{ONE}", "sent"),
              query(f"sdrlink_air_heard_ratio{ONE}", "heard"), span=THIRD, stacked=True)
    ).with_panel(
        graph("Bursts by MCS", "Bursts that left, a second.", "short",
              query(f"rate(sdrlink_bursts_by_mcs_total{ONE}{RATE})", "MCS {{mcs}}"),
              span=THIRD, stacked=True)
    )  # fmt: skip
    return made


def _queue(made: Dashboard) -> Dashboard:
    waits = ("queue", "access", "again")
    made.with_row(Row("Queue"))
    made.with_panel(
        graph("Waiting by class", "Messages in the queue.", "short",
              query(f"sdrlink_tx_queued_by_class{ONE}", "{{class}}"), span=THIRD, stacked=True)
    ).with_panel(
        graph("Age when sent, by topic",
              "Recent mean of the waits: behind others, for the channel, and to be sent again.",
              "s", *(query(f"sdrlink_topic_{each}_seconds{ONE}", f"{{{{topic}}}}: {each}")
                     for each in waits), span=THIRD)
    ).with_panel(
        graph("Dropped", "Messages and PDUs a second, by reason: sdrlinkctl help REASON.", "short",
              query(f"rate(sdrlink_tx_dropped_total{ONE}{RATE}) > 0", "{{reason}}"),
              query(f"rate(sdrlink_rx_dropped_total{ONE}{RATE}) > 0", "{{reason}}"),
              query(f"rate(sdrlink_rx_pdus_dropped_total{ONE}{RATE}) > 0", "{{reason}}"),
              span=THIRD)
    )  # fmt: skip
    return made


def _ages(made: Dashboard) -> Dashboard:
    made.with_row(Row("What others sent"))
    made.with_panel(
        graph("Age, median", "Age of the recent messages at their handover.", "s",
              query(f"sdrlink_received_age_p50_seconds{ONE}", "{{robot}} {{topic}}"), span=THIRD)
    ).with_panel(
        graph("Age, p99", "99 % of the recent messages were no older.", "s",
              query(f"sdrlink_received_age_p99_seconds{ONE}", "{{robot}} {{topic}}"), span=THIRD)
    ).with_panel(
        graph("PDR", "Share of the messages that were delivered since the start.", "percentunit",
              query(f"sdrlink_received_delivered_ratio{ONE}", "{{robot}} {{topic}}"), span=THIRD)
    )  # fmt: skip
    return made


def fleet() -> Dashboard:
    """The dashboard of all robots."""
    made = board("sdrlink: the fleet", FLEET, "All robots at a glance; a row leads to the robot.")
    known = "last_over_time(sdrlink_info[1h])"
    present = (
        f"max by (node) (sdrlink_up * on (instance, runtime_dir) group_right () {known}) "
        f"or 0 * max by (node) ({known})"
    )
    snr = f"min by (node) (sdrlink_neighbor_snr_db {OTHERS})"
    loss = f"max by (node) (sdrlink_neighbor_lately_loss_ratio {OTHERS})"
    worst = (
        f"max by (node, robot) (topk by (node) (1, sdrlink_neighbor_lately_loss_ratio {OTHERS}))"
    )
    lost = f"sum by (node) (sdrlink_neighbor_last_heard_age_seconds > bool {LOST_S})"
    pdr = "min by (node) (sdrlink_received_delivered_ratio)"
    air = "max by (node) (sdrlink_air_sent_ratio + sdrlink_air_heard_ratio)"
    made.with_panel(
        by_robot("Robots", "Worst neighbor: the one of which most PDUs were lost in the last 5 s. "
                 "PDR: of the worst topic received.", [
                     Column("daemon", present, words=PRESENCE),
                     Column("verdict", verdict(), words=VERDICTS),
                     Column("worst loss", worst, "percentunit", steps=LITTLE_LOSS),
                     Column("lowest SNR", snr, "dB", steps=GOOD_SNR),
                     Column("PDR", pdr, "percentunit", steps=MUCH_PDR),
                     Column("air in use", air, "percentunit", steps=FREE_AIR),
                     Column("sealing", seal(), words=SEALS),
                     Column("robots lost", lost, steps=NONE_LOST),
                 ], f"/d/{ROBOT}"),
    ).with_panel(
        states("Verdicts", "OK, DEGRADED or DOWN.", VERDICTS, query(verdict(), "robot {{node}}"))
    ).with_panel(
        graph("Alerts", "Alerts that fire: etc/prometheus/sdrlink.rules.yml.", "short",
              query(f"count by (alertname, node) ({ALERTS})", "{{alertname}} {{node}}"),
              span=THIRD)
    ).with_panel(
        graph("Worst loss", "Largest share of a neighbor's PDUs lost in the last 5 s.",
              "percentunit", query(loss, "robot {{node}}"), span=THIRD)
    ).with_panel(
        graph("Air in use", "Airtime of own bursts and of those heard.", "percentunit",
              query(air, "robot {{node}}"), span=THIRD)
    )  # fmt: skip
    return made


def files() -> dict[Path, str]:
    """The files of all dashboards, and their texts."""
    return {
        FOLDER / f"{uid}.json": text_of(made) for uid, made in ((ROBOT, robot()), (FLEET, fleet()))
    }


def main() -> int:
    """Write them."""
    FOLDER.mkdir(exist_ok=True)
    for path, text in files().items():
        path.write_text(text)
        sys.stdout.write(f"wrote {path.name}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
