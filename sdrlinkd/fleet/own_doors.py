"""Tries to command robots as a stranger, before the gateway takes commands from others."""

import asyncio
import json
import logging
import secrets

import zenoh

from sdrlinkd.config import FleetParams
from sdrlinkd.errors import ConfigError
from sdrlinkd.fleet.keys import Keys
from sdrlinkd.fleet.samples import Sample
from sdrlinkd.fleet.session import Session
from sdrlinkd.fleet.zenoh_config import authority, endpoints

MOST_TRIED = 8
OPENS_S, ARRIVES_S = 2.0, 0.5
"""Time in s for a stranger to connect, and for what it puts to arrive."""
_EVERYWHERE = {"0.0.0.0": "127.0.0.1", "[::]": "[::1]"}  # noqa: S104
_STRANGE = b"\xc1"
"""An attachment that nobody can read, so that no gateway takes it for a command."""

_log = logging.getLogger(__name__)


async def check_doors(session: Session, params: FleetParams, own_id: int) -> None:
    """If commands are taken, put something at each endpoint without a certificate.

    Raises ConfigError if it arrives. What a router lets through may change while the gateway runs,
    so it is named in the log.
    """
    if not (params.down or params.bridge):
        return
    doors, routers = (endpoints(session.config, end) for end in ("listen", "connect"))
    for each in routers:
        _log.warning("the Zenoh router at %s decides who may command robots", each)
    topics = [each.replace("*", "x") for each in (*params.down, *params.bridge)]
    keys = [Keys(params.name).message(own_id, each) for each in topics[:MOST_TRIED]]
    if params.ros_domain is not None:
        keys.append(f"{params.ros_domain}/door")
    tried = [*doors, *routers]
    opened = await asyncio.gather(*(_lets_strangers(session, keys, each) for each in tried))
    for each, is_open in zip(tried, opened, strict=True):
        if is_open:
            raise ConfigError(
                f'"{each}": a program without a certificate may command robots there; allowed: '
                "endpoints that ask for one (enable_mtls), or access control that denies by default"
            )


async def _lets_strangers(session: Session, keys: list[str], endpoint: str) -> bool:
    arrived, mark = asyncio.Event(), secrets.token_bytes(8)

    def take(sample: Sample) -> None:
        if sample.payload == mark:
            arrived.set()

    ends = [session.subscribe(key, take) for key in keys]
    try:
        stranger = await asyncio.to_thread(_open, _strangers(session.config, endpoint))
        if stranger is None:
            return False
        try:
            async with asyncio.timeout(ARRIVES_S):
                while not arrived.is_set():
                    for key in keys:
                        await asyncio.to_thread(stranger.put, key, mark, attachment=_STRANGE)
                    await asyncio.sleep(ARRIVES_S / 10)
        except TimeoutError:
            return False
        finally:
            await asyncio.to_thread(stranger.close)
    finally:
        for end in ends:
            end()
    return True


def _open(config: zenoh.Config) -> zenoh.Session | None:
    try:
        return zenoh.open(config)
    except zenoh.ZError:
        return None


def _strangers(config: zenoh.Config, endpoint: str) -> zenoh.Config:
    """The configuration of a program that knows the endpoint, and nothing else."""
    for host, own in _EVERYWHERE.items():
        endpoint = endpoint.replace(f"/{host}:", f"/{own}:")
    stranger = zenoh.Config()
    settings: dict[str, object] = {
        "mode": "client",
        "connect/endpoints": [endpoint],
        "connect/timeout_ms": round(1e3 * OPENS_S),
        "scouting/multicast/enabled": False,
        "transport/link/tls": {**authority(config), "verify_name_on_connect": False},
    }
    for name, value in settings.items():
        stranger.insert_json5(name, json.dumps(value))
    return stranger
