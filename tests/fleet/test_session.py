"""The Zenoh session on an event loop: callbacks in order, faults that stay where they are."""

import asyncio
import json
import logging

import pytest

from sdrlinkd.config import FleetParams
from sdrlinkd.errors import ConfigError
from sdrlinkd.fleet import make_zenoh_config, open_session
from tests.fleet.conftest import Router
from tests.waiting import wait_for


@pytest.fixture
def router():
    found = Router()
    found.start()
    yield found
    found.stop()


@pytest.fixture
async def session(router, tmp_path):
    opened = await open_session(FleetParams(name="mine", connect=[router.endpoint]), tmp_path)
    yield opened
    await opened.close()


async def test_values_come_in_order_and_one_that_cannot_be_handled_stops_nothing(
    router, session, caplog
):
    caplog.set_level(logging.CRITICAL, logger="asyncio")
    found = []

    def take(sample):
        number = int(sample.payload)
        if number == 7:
            raise ValueError(number)
        found.append(number)

    end = session.subscribe("a/**", take)
    await asyncio.sleep(0.2)
    for number in range(2000):
        router.session.put("a/b", str(number).encode())
    await asyncio.to_thread(wait_for, lambda: len(found) >= 1999)
    assert found == [number for number in range(2000) if number != 7]
    end()
    router.session.put("a/b", b"9999")
    await asyncio.sleep(0.2)
    assert len(found) == 1999


async def test_it_opens_as_soon_as_a_router_is_there(router, tmp_path, caplog):
    router.stop()
    params = FleetParams(name="mine", connect=[router.endpoint])
    opening = asyncio.ensure_future(open_session(params, tmp_path))
    await asyncio.sleep(0.3)
    assert not opening.done()
    assert "no Zenoh router is reached" in caplog.text
    router.start()
    opened = await asyncio.wait_for(opening, 20)
    await opened.close()


@pytest.mark.parametrize(
    ("params", "said"),
    [
        ({"down": ["cmd_vel"]}, "tcp/localhost:7447"),
        ({"down": ["cmd_vel"], "connect": ["tls/a:1"], "listen": ["tcp/b:2"]}, "tcp/b:2"),
        ({"bridge": ["*"], "connect": ["tcp/a:1"]}, "bridge sends to robots what others put"),
        ({"zenoh": "absent.json5"}, "fleet.zenoh: "),
    ],
)
def test_what_is_not_safe_or_not_there_is_refused(params, said, tmp_path):
    with pytest.raises(ConfigError, match=said):
        make_zenoh_config(FleetParams(**params), tmp_path)


def test_no_memory_is_shared(tmp_path):
    """A hardened service may not lock it; what a file of Zenoh says does not count."""
    (tmp_path / "zenoh.json5").write_text("{transport: {shared_memory: {enabled: true}}}")
    for file in ("", "zenoh.json5"):
        config = make_zenoh_config(FleetParams(name="mine", zenoh=file), tmp_path)
        assert config.get_json("transport/shared_memory/enabled") == "false"


def test_tls_or_access_control_will_do(tmp_path):
    make_zenoh_config(FleetParams(down=["cmd_vel"], connect=["tls/a:1", "quic/b:2"]), tmp_path)
    (tmp_path / "acl.json5").write_text("{access_control: {enabled: true}}")
    make_zenoh_config(FleetParams(down=["cmd_vel"], zenoh="acl.json5"), tmp_path)


@pytest.mark.parametrize(
    ("file", "mode", "connect"),
    [
        ("{access_control: {enabled: true}}", "client", ["tcp/localhost:7447"]),
        ('{mode: "router"}', "router", []),
        ('{mode: "client", connect: {endpoints: ["tcp/a:1"]}}', "client", ["tcp/a:1"]),
    ],
)
def test_a_file_of_zenoh_counts_where_it_says_whom_to_connect_to(file, mode, connect, tmp_path):
    (tmp_path / "zenoh.json5").write_text(file)
    config = make_zenoh_config(FleetParams(zenoh="zenoh.json5"), tmp_path)
    assert json.loads(config.get_json("mode")) == mode
    assert json.loads(config.get_json("connect/endpoints")) == connect
