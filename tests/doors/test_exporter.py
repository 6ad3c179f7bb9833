"""The exporter: figures for whoever reaches it, and nothing to change for anybody."""

import http.client

import pytest

from tests.programs import sdrlinkctl


@pytest.mark.slow
def test_whatever_is_asked_of_the_exporter_it_tells_figures_and_changes_nothing(start_daemon):
    daemon = start_daemon()
    at = ("--runtime-dir", daemon.directory, "--listen", "127.0.0.1:0")
    with sdrlinkctl("exporter", *at) as exporter:
        port = int(exporter.line().rpartition(":")[2].partition("/")[0])

        def ask(method, path, body=None):
            client = http.client.HTTPConnection("127.0.0.1", port, timeout=10)
            client.request(method, path, body)
            answer = client.getresponse()
            return answer.status, answer.read().decode()

        before = daemon.snapshot().bus.control_requests
        for method in ("POST", "PUT", "DELETE", "PATCH"):
            status, said = ask(method, "/set?topic=odom&priority=9", b'{"priority": 9}')
            assert status >= 400, method
            assert "sdrlink" not in said
        assert daemon.snapshot().bus.control_requests == before + 1, "the daemon was not asked"
        assert "sdrlink_up{" in ask("GET", "/metrics")[1]
