"""The exporter and Debian's Prometheus, both of them real."""

import contextlib
import json
import socket
import subprocess
import urllib.error
import urllib.request
from urllib.parse import quote

import pytest

from tests.conftest import ETC
from tests.programs import sdrlinkctl
from tests.waiting import wait_for

RULES = ETC / "prometheus/sdrlink.rules.yml"
"""The shipped alerts."""
STARTING = 503


@pytest.fixture
def start_exporter():
    """Starts exporters for daemons; returns their addresses."""
    with contextlib.ExitStack() as stack:

        def start(*daemons):
            at = [word for each in daemons for word in ("--runtime-dir", each.directory)]
            process = sdrlinkctl("exporter", *at, "--listen", "127.0.0.1:0")
            return stack.enter_context(process).line().split()[-1]

        yield start


class Prometheus:
    """A Prometheus that reads one exporter twice a second, with the alerts in `rules`."""

    def __init__(self, folder, exporter, rules=()):
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self.address = f"127.0.0.1:{free.getsockname()[1]}"
        config = {
            "global": {"scrape_interval": "500ms", "evaluation_interval": "500ms"},
            "rule_files": [str(each) for each in rules],
            "scrape_configs": [
                {"job_name": "sdrlink", "static_configs": [{"targets": [exporter.split("/")[2]]}]}
            ],
        }
        (folder / "prometheus.yml").write_text(json.dumps(config))
        options = {
            "config.file": folder / "prometheus.yml",
            "storage.tsdb.path": folder / "data",
            "web.listen-address": self.address,
        }
        command = ["prometheus", *(f"--{name}={value}" for name, value in options.items())]
        self._log = (folder / "log").open("w")
        self._process = subprocess.Popen(command, stdout=self._log, stderr=self._log)
        wait_for(lambda: bool(self.query("sdrlink_up")), 60)

    def ask(self, path):
        """The data that it answers with.

        Raises ValueError with its words if it refuses, and OSError while it is starting.
        """
        url = f"http://{self.address}/api/v1/{path}"
        try:
            return json.load(urllib.request.urlopen(url, timeout=10))["data"]
        except urllib.error.HTTPError as error:
            if error.code == STARTING:
                raise ConnectionError(error.reason) from None
            raise ValueError(json.load(error)["error"]) from None

    def query(self, expr):
        """The series of an expression now; none while Prometheus is starting."""
        try:
            return self.ask(f"query?query={quote(expr)}")["result"]
        except OSError:
            return []

    def close(self):
        self._process.terminate()
        self._process.wait(20)
        self._log.close()


@pytest.fixture
def start_prometheus(tmp_path):
    """Starts a Prometheus for one exporter."""
    with contextlib.ExitStack() as stack:

        def start(exporter, rules=()):
            made = Prometheus(tmp_path, exporter, rules)
            stack.callback(made.close)
            return made

        yield start
