"""Zenoh's configuration, from `[fleet]` and a file of Zenoh's own."""

import json
from pathlib import Path

import zenoh

from sdrlinkd.config import FleetParams
from sdrlinkd.errors import ConfigError

LOCAL_ROUTER = "tcp/localhost:7447"
RETRY = {"period_init_ms": 100, "period_max_ms": 500, "period_increase_factor": 1.5}
SAFE_PROTOCOLS = ("tls", "quic")


def make_zenoh_config(params: FleetParams, folder: Path) -> zenoh.Config:
    """Zenoh's configuration; raises ConfigError.

    Where the file given in `zenoh` says whom to connect to, that counts unless `[fleet]` says it. A
    fleet that sends to robots needs TLS at all endpoints, or access control.
    """
    config = zenoh.Config()
    if params.zenoh:
        path = folder / params.zenoh
        try:
            config = zenoh.Config.from_file(str(path))
        except zenoh.ZError as error:
            raise ConfigError(f"fleet.zenoh: {path}: {cause(error)}") from None
    connect = params.connect or ([] if params.listen else [LOCAL_ROUTER])
    if params.connect or params.listen or not _says_where(config):
        settings: dict[str, object] = {
            "mode": "router" if params.listen else "client",
            "connect/endpoints": connect,
            "listen/endpoints": params.listen,
            "scouting/multicast/enabled": False,
        }
        for key, value in settings.items():
            config.insert_json5(key, json.dumps(value))
    if params.ros_domain is not None:
        # Where values are kept for subscribers that come later, Zenoh needs times.
        config.insert_json5("timestamping/enabled", "true")
    # Messages are small, and Zenoh locks what it shares, which a hardened service may not do.
    config.insert_json5("transport/shared_memory/enabled", "false")
    # `open_session` tries again by itself, as a thread that waits in Zenoh cannot be stopped.
    config.insert_json5("connect/timeout_ms", "0")
    config.insert_json5("connect/retry", json.dumps(RETRY))
    for key in ("down", "bridge"):
        if getattr(params, key):
            _check_guard(config, key)
    return config


def _says_where(config: zenoh.Config) -> bool:
    """Whether a file has changed how nodes find each other."""
    keys, plain = ("mode", "connect/endpoints", "listen/endpoints"), zenoh.Config()
    return any(config.get_json(key) != plain.get_json(key) for key in keys)


def _check_guard(config: zenoh.Config, key: str) -> None:
    """Refuse to send to robots what anybody on the network may have put. Raises ConfigError."""
    if json.loads(config.get_json("access_control")).get("enabled"):
        return
    given = [*_endpoints(config, "connect"), *_endpoints(config, "listen")]
    open_ones = [each for each in given if each.split("/")[0] not in SAFE_PROTOCOLS]
    if open_ones or not given:
        raise ConfigError(
            f"fleet.{key} sends to robots what others put on Zenoh, and "
            f'"{(open_ones or ["…"])[0]}" is open to everybody on the network; use tls/ '
            "endpoints, or switch on access control in the file that fleet.zenoh names"
        )


def _endpoints(config: zenoh.Config, end: str) -> list[str]:
    """All endpoints of one kind, however the file groups them by mode."""
    given = json.loads(config.get_json(f"{end}/endpoints"))
    groups = given.values() if isinstance(given, dict) else [given]
    return [each for group in groups for each in group or ()]


def cause(error: zenoh.ZError) -> str:
    """What went wrong, without the place in Zenoh's source."""
    return str(error).split(" at /", maxsplit=1)[0].strip()
