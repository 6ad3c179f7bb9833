"""Dashboards for Grafana: as described, by its schema, and with queries that find something."""

import contextlib
import json
import re
import shutil
import threading
import time
from urllib.parse import quote

import pytest

from docs.site.dashboards import FOLDER, files
from sdrlinkd.client import Publisher
from tests.exporter.conftest import RULES
from tests.exporter.grafana import mistakes, queries
from tests.machine import lacks
from tests.pairs import pair
from tests.waiting import wait_for

TEXTS = {path.name: path.read_text() for path in sorted(FOLDER.glob("*.json"))}
MAY_BE_EMPTY = {
    "Alerts A": "no alert fires for a link that works",
    "annotation Alerts": "the same",
    "Dropped B": "all messages that arrive in part arrive whole on a clear air",
}
"""Queries that find nothing in a link with traffic, and why."""
PATIENCE_S = 60.0


def test_dashboards_are_those_of_their_description():
    for path, text in files().items():
        assert path.read_text() == text, "`make reference` writes it anew"
    assert set(files()) == set(FOLDER.iterdir())


@pytest.mark.parametrize("name", TEXTS)
def test_dashboards_follow_grafanas_schema(name):
    assert mistakes(TEXTS[name]) == []
    given = json.loads(TEXTS[name])
    spots = [each["gridPos"] for each in given["panels"]]
    cells = [
        (x, y)
        for at in spots
        for x in range(at["x"], at["x"] + at["w"])
        for y in range(at["y"], at["y"] + at["h"])
    ]
    assert len(set(cells)) == len(cells), "panels cover each other"
    assert max(x for x, _ in cells) < 24
    for each in given["panels"]:
        if each["type"] != "row":
            assert each["title"], each
            assert each["description"], each["title"]
            assert each["datasource"] == {"type": "prometheus", "uid": "${datasource}"}


def test_what_breaks_the_schema_is_found():
    given = json.loads(TEXTS["sdrlink-robot.json"])
    panel = given["panels"][0]
    panel["colour"] = "red"
    panel["targets"][0]["instant"] = "yes"
    panel["options"]["colorMode"] = "loud"
    panel["gridPos"]["h"] = True
    del given["title"]
    given["time"] = "now"
    found = "\n".join(mistakes(json.dumps({**given, "time": {"from": 5, "to": "now"}})))
    for each in ("panels[0].colour: unknown", "instant: got 'yes'", "'loud'; allowed: ['value'",
                 "grid_pos.h: got True", "from_val: got 5; allowed: str"):  # fmt: skip
        assert each in found, (each, found)


@contextlib.contextmanager
def traffic(*daemons):
    """Messages both ways, ten a second; some are too old before they can be sent."""
    is_over = threading.Event()

    def send():
        with contextlib.ExitStack() as stack:
            outs = [
                (stack.enter_context(Publisher(runtime_dir=each.directory)), robot)
                for robot, each in enumerate(daemons, 1)
            ]
            while not is_over.wait(0.1):
                for out, robot in outs:
                    out.send(f"/robot_{robot}/imu", b"\0\1\0\0" + bytes(60))
                    out.send(f"/robot_{robot}/odom", b"\0\1\0\0", lifespan_ms=0.01)

    thread = threading.Thread(target=send)
    thread.start()
    try:
        yield
    finally:
        is_over.set()
        thread.join()


@pytest.mark.long
@pytest.mark.skipif(shutil.which("prometheus") is None, reason=lacks("prometheus"))
def test_every_query_finds_something_in_a_link_with_traffic(
    start_daemon, start_exporter, start_prometheus, tmp_path_factory
):
    def found(expr):
        asked = expr.replace("$node", "2").replace("$__rate_interval", "5s")
        assert "$" not in asked, asked
        label = re.fullmatch(r"label_values\((\w+), (\w+)\)", asked)
        if label:
            return prometheus.ask(f"label/{label[2]}/values?match[]={quote(label[1])}")
        return prometheus.ask(f"query?query={quote(asked)}")["result"]

    def column(target):
        return {each["metric"]["node"]: each["value"][1] for each in found(target["expr"])}

    asked = {
        (name, where): expr for name, text in TEXTS.items() for where, expr in queries(text).items()
    }
    assert len(asked) > 40
    must = {each for each in asked if each[1] not in MAY_BE_EMPTY}
    robots = json.loads(TEXTS["sdrlink-fleet.json"])["panels"][0]["targets"]
    with pair(start_daemon, tmp_path_factory.mktemp("hub")) as daemons:
        with traffic(*daemons):
            prometheus = start_prometheus(start_exporter(*daemons), [RULES])
            until, wanting = time.monotonic() + PATIENCE_S, set(asked)
            while wanting & must and time.monotonic() < until:
                time.sleep(0.5)
                wanting = {each for each in wanting if not found(asked[each])}
            assert {where: asked[where] for where in wanting & must} == {}
            for target in robots:
                assert set(column(target)) == {"1", "2"}, target["expr"]
        assert found("label_values(sdrlink_uptime_seconds, node)") == ["1", "2"]
        with pytest.raises(ValueError, match="parse error"):
            found("rate(sdrlink_tx_sent_total)[")
        assert column(robots[0]) == {"1": "1", "2": "1"}
        # A robot whose daemon has gone keeps its row.
        daemons[1].stop()
        wait_for(lambda: column(robots[0]) == {"1": "1", "2": "0"})
