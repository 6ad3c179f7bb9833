"""Metrics: all figures of the snapshot, by Prometheus's conventions, read by Prometheus itself."""

import json
import re
import shutil
import subprocess
import sys
import urllib.request
from pathlib import Path

import msgspec
import pytest
from prometheus_client import CollectorRegistry
from prometheus_client.openmetrics.exposition import generate_latest
from prometheus_client.openmetrics.parser import text_string_to_metric_families

from sdrlinkd.cli import run
from sdrlinkd.client import Publisher
from sdrlinkd.exporter import Collector, families, plain, samples
from sdrlinkd.extras import hint
from sdrlinkd.reports import TopicReport
from tests.exporter.conftest import RULES
from tests.machine import lacks
from tests.waiting import wait_for

STATE = "sdrlink_verdict_level"
CLOCK = "sdrlink_neighbor_clock_state"
needs_prometheus = pytest.mark.skipif(shutil.which("promtool") is None, reason=lacks("prometheus"))


@pytest.fixture
def daemon(start_daemon):
    """A daemon on the loopback that has sent and heard 20 messages."""
    daemon = start_daemon()
    with Publisher(runtime_dir=daemon.directory) as out:
        for number in range(20):
            out.send("/robot_1/odom", b"\0\1\0\0" + bytes([number]))
    wait_for(lambda: daemon.snapshot().link.rx.delivered == 20)
    return daemon


def parsed(*snapshots, collector=None):
    """{metric: {labels: value}} of what the exporter tells of daemons, as OpenMetrics."""
    told = dict(zip(map(Path, "abcd"), snapshots, strict=False))
    registry = CollectorRegistry()
    registry.register(collector or Collector(lambda: told, told.get))
    text = generate_latest(registry).decode()
    return {
        sample.name: {frozenset(s.labels.items()): s.value for s in family.samples
                      if s.name == sample.name}
        for family in text_string_to_metric_families(text)
        for sample in family.samples
    }  # fmt: skip


def only(values, **labels):
    """The one value whose labels contain these."""
    (found,) = [v for k, v in values.items() if set(labels.items()) <= k]
    return found


def test_names_follow_the_conventions_and_have_a_help_text():
    made = families()
    assert len({each.name for each in made}) == len(made) > 130
    for each in made:
        assert re.fullmatch(r"[a-z][a-z0-9_]*", each.name), each
        assert not re.search(r"_(ms|us|s|pct|ppm|ns|total|count|sum)$", each.name), each
        assert len(each.help) > 10, each
        assert "null:" not in each.help, each


def test_every_figure_of_a_daemon_is_told_in_base_units(daemon):
    snapshot = daemon.snapshot()
    told = parsed(snapshot)
    node = {"node": "1", "namespace": "robot_1"}
    assert only(told["sdrlink_up"]) == 1
    assert only(told["sdrlink_tx_sent_total"], **node) == snapshot.link.tx.sent
    assert only(told["sdrlink_airtime_seconds_total"]) == pytest.approx(snapshot.link.airtime_s)
    assert only(told["sdrlink_topic_accepted_total"], topic="/robot_1/odom") == 20
    (heard,) = snapshot.link.received
    age = only(told["sdrlink_received_age_p50_seconds"], robot="1", topic="/odom")
    assert age == pytest.approx(heard.age_ms_p50 / 1000)
    assert only(told["sdrlink_verdict_level"], sdrlink_verdict_level="OK") == 1
    assert only(told["sdrlink_verdict_level"], sdrlink_verdict_level="DOWN") == 0
    about = {"version": snapshot.version, "backend": "direct", "runtime_dir": "a"}
    assert only(told["sdrlink_info"], **about) == 1
    assert {each.name for each, _ in samples(plain(snapshot))} >= {
        "uptime_seconds",
        "tx_queued_bytes",
    }


def test_a_counter_never_goes_back_unless_the_daemon_starts_anew(daemon):
    snapshot = daemon.snapshot()
    told = {Path("a"): snapshot}
    collector = Collector(lambda: told, told.get)

    def sent(n, uptime_s):
        tx = msgspec.structs.replace(snapshot.link.tx, sent=n)
        link = msgspec.structs.replace(snapshot.link, tx=tx)
        told[Path("a")] = msgspec.structs.replace(snapshot, link=link, uptime_s=uptime_s)
        return only(parsed(collector=collector)["sdrlink_tx_sent_total"])

    assert [sent(10, 100.0), sent(9, 101.0), sent(11, 102.0), sent(3, 1.0)] == [10, 10, 11, 3]


def test_hostile_names_stay_in_their_labels(daemon):
    snapshot = daemon.snapshot()
    name = 'x"} 1\nsdrlink_up 0 # \\'
    topics = [TopicReport(topic_id=0, name=name, type="", subscribed=True, qos="", priority=0)]
    link = msgspec.structs.replace(snapshot.link, topics=topics)
    told = parsed(msgspec.structs.replace(snapshot, link=link))
    assert only(told["sdrlink_topic_accepted_total"], topic=name) == 0
    assert only(told["sdrlink_up"]) == 1


def test_a_daemon_that_does_not_answer_is_down_and_the_others_are_told(daemon):
    told = parsed(daemon.snapshot(), None)
    assert only(told["sdrlink_up"], runtime_dir="a") == 1
    assert only(told["sdrlink_up"], runtime_dir="b") == 0
    assert only(told["sdrlink_tx_sent_total"]) == 20


@pytest.fixture
def exporter(daemon, start_exporter):
    """The address of an exporter for that daemon."""
    return start_exporter(daemon)


@needs_prometheus
def test_promtool_has_nothing_to_say_against_the_text(exporter):
    text = urllib.request.urlopen(exporter, timeout=20).read()
    done = subprocess.run(["promtool", "check", "metrics"], input=text, capture_output=True)
    assert (done.returncode, done.stderr.decode()) == (0, "")


@needs_prometheus
@pytest.mark.long
def test_prometheus_reads_it_and_evaluates_every_rule(exporter, start_prometheus):
    prometheus = start_prometheus(exporter, [RULES])

    def rules():
        return [rule for group in prometheus.ask("rules")["groups"] for rule in group["rules"]]

    wait_for(lambda: bool(prometheus.query("sdrlink_tx_sent_total")), 60)
    (found,) = prometheus.query('sdrlink_topic_sent_total{topic=~".*odom"}')
    assert found["value"][1] == "20"
    wait_for(lambda: rules() and all(rule["health"] == "ok" for rule in rules()), 60)
    assert {rule["state"] for rule in rules()} == {"inactive"}


def test_an_address_that_is_none_and_a_missing_library_are_one_sentence(monkeypatch, capsys):
    assert run(["exporter", "--listen", "nonsense"]) == 2
    assert 'got "nonsense"; allowed: HOST:PORT' in capsys.readouterr().err
    monkeypatch.setitem(sys.modules, "prometheus_client", None)
    assert run(["exporter"]) == 2
    assert hint("metrics") in capsys.readouterr().err


@pytest.mark.slow
@needs_prometheus
def test_each_alert_fires_when_it_should(tmp_path):
    of = 'node="1",namespace="robot_1"'
    series = {
        "SdrlinkDaemonGone": ('sdrlink_up{runtime_dir="/run/sdrlinkd"}', "1 0x20"),
        "SdrlinkLinkDown": (f'{STATE}{{{of},{STATE}="DOWN"}}', "0 1x20"),
        "SdrlinkLinkDegraded": (f'{STATE}{{{of},{STATE}="DEGRADED"}}', "0 1x20"),
        "SdrlinkRobotLost": (
            f'sdrlink_neighbor_last_heard_age_seconds{{{of},robot="2"}}', "0+5x20",
        ),
        "SdrlinkQueueOld": (f'sdrlink_tx_dropped_total{{{of},reason="tx_expired"}}', "0+3x20"),
        "SdrlinkClockUnsynced": (f'{CLOCK}{{{of},robot="2",{CLOCK}="unsynced"}}', "1x20"),
        "SdrlinkSealedOff": (
            f'sdrlink_rx_pdus_dropped_total{{{of},reason="sec_bad_tag"}}', "0+50x20",
        ),
    }  # fmt: skip
    used = {"series": f"sdrlink_rx_pdus_used_total{{{of}}}", "values": "0+1x20"}
    quiet = {"SdrlinkRobotLost": "0x20", "SdrlinkQueueOld": "7x20", "SdrlinkClockUnsynced": "0x20",
             "SdrlinkSealedOff": "0+0x20", "SdrlinkDaemonGone": "1x20"}  # fmt: skip
    named = set(re.findall(r"alert: (\w+)", RULES.read_text()))
    assert named == set(series)

    firing = 'alertstate="firing"'

    def rules_fire(told, expected):
        tests = [
            {
                "interval": "5s",
                "input_series": [{"series": name, "values": values}, used],
                "promql_expr_test": [
                    {
                        "expr": f'count(ALERTS{{{firing},alertname="{alert}"}}) or vector(0)',
                        "eval_time": "95s",
                        "exp_samples": [{"labels": "{}", "value": expected}],
                    }
                ],
            }
            for alert, (name, values) in told.items()
        ]
        given = {"rule_files": [str(RULES)], "evaluation_interval": "5s", "tests": tests}
        path = tmp_path / "alerts.yml"
        path.write_text(json.dumps(given))
        done = subprocess.run(["promtool", "test", "rules", path], capture_output=True, text=True)
        assert done.returncode == 0, done.stdout + done.stderr

    rules_fire(series, 1)
    rules_fire({alert: (series[alert][0], quiet.get(alert, "0x20")) for alert in series}, 0)
