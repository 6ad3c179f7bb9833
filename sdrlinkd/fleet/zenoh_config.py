"""Zenoh's configuration, from `[fleet]` and a file of Zenoh's own."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import zenoh

from sdrlinkd.config import FleetParams
from sdrlinkd.errors import ConfigError
from sdrlinkd.fleet.keys import Keys

LOCAL_ROUTER = "tcp/localhost:7447"
RETRY = {"period_init_ms": 100, "period_max_ms": 500, "period_increase_factor": 1.5}
SAFE_PROTOCOLS = ("tls", "quic")
_MAKE = "sdrlinkctl key certificates makes them"


def make_zenoh_config(params: FleetParams, folder: Path) -> zenoh.Config:
    """Zenoh's configuration; raises ConfigError.

    Where the file given in `zenoh` says whom to connect to, that counts unless `[fleet]` says it. A
    fleet that sends to robots needs TLS at all endpoints, and asks who connects for a certificate;
    or access control that denies by default.
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
            _check_doors(config, key, params)
    return config


def _says_where(config: zenoh.Config) -> bool:
    """Whether a file has changed how nodes find each other."""
    keys, plain = ("mode", "connect/endpoints", "listen/endpoints"), zenoh.Config()
    return any(config.get_json(key) != plain.get_json(key) for key in keys)


def _check_doors(config: zenoh.Config, key: str, params: FleetParams) -> None:
    """Refuse to send to robots what anybody on the network may have put. Raises ConfigError."""
    listen, connect = endpoints(config, "listen"), endpoints(config, "connect")
    open_ones = [each for each in connect if not _is_tls(each)]
    if open_ones or not (listen or connect):
        raise ConfigError(
            f"fleet.{key} sends to robots what others put on Zenoh, and "
            f'"{(open_ones or ["…"])[0]}" is open to everybody on the network; use tls/ or quic/ '
            f"endpoints, and certificates: {_MAKE}"
        )
    asks = tls_setting(config, "enable_mtls") and authority(config)
    if not listen or (asks and all(map(_is_tls, listen))):
        return
    rules = json.loads(config.get_json("access_control"))
    if not rules.get("enabled"):
        raise ConfigError(
            f"fleet.{key} sends to robots what others put on Zenoh, and anybody may connect to "
            f'"{listen[0]}"; use tls/ or quic/ endpoints where transport/link/tls has enable_mtls '
            f"and a root_ca_certificate ({_MAKE}), or access_control that denies by default"
        )
    # Nodes on rmw_zenoh put messages, and call services by queries.
    entrances = {Keys(params.name).all_commands: {"put"}}
    if params.ros_domain is not None:
        entrances[f"{params.ros_domain}/**"] = {"put", "query"}
    if fault := _fault(rules, entrances):
        raise ConfigError(
            f"fleet.{key} sends to robots what others put on Zenoh, and access_control {fault}"
        )


def tls_setting(config: zenoh.Config, name: str) -> object:
    """A setting of TLS; what is secret is shown only if it is asked for by its own name."""
    return json.loads(config.get_json(f"transport/link/tls/{name}"))


def authority(config: zenoh.Config) -> dict[str, object]:
    """Whose certificates count: the settings that say so, if any."""
    names = ("root_ca_certificate", "root_ca_certificate_base64")
    found = {name: tls_setting(config, name) for name in names}
    return {name: value for name, value in found.items() if value}


def _is_tls(endpoint: str) -> bool:
    return endpoint.split("/")[0] in SAFE_PROTOCOLS


def _fault(rules: dict[str, Any], entrances: Mapping[str, set[str]]) -> str:
    """Why rules of access control let anybody command robots; empty if they do not.

    `entrances` are the keys by which robots are commanded, and the kinds of messages.
    """
    if rules.get("default_permission") != "deny":
        return f'has default_permission {rules.get("default_permission")!r}; allowed: "deny"'
    subjects = {each["id"]: each for each in rules.get("subjects") or ()}
    allowing = {
        rule["id"]: entrance
        for rule in rules.get("rules") or ()
        for entrance, kinds in entrances.items()
        if rule["permission"] == "allow"
        and not kinds.isdisjoint(rule["messages"])
        and any(zenoh.KeyExpr(key).intersects(zenoh.KeyExpr(entrance)) for key in rule["key_exprs"])
    }
    for policy in rules.get("policies") or ():
        opened = [allowing[each] for each in policy["rules"] if each in allowing]
        for name in policy["subjects"] if opened else ():
            subject = subjects.get(name, {})
            if not (subject.get("cert_common_names") or subject.get("usernames")):
                return (
                    f"lets subject {name!r} command at {opened[0]}, who may be anybody; allowed: "
                    "subjects with cert_common_names or usernames"
                )
    return ""


def endpoints(config: zenoh.Config, end: str) -> list[str]:
    """All endpoints of one kind, however the file groups them by mode."""
    given = json.loads(config.get_json(f"{end}/endpoints"))
    groups = given.values() if isinstance(given, dict) else [given]
    return [each for group in groups for each in group or ()]


def cause(error: zenoh.ZError) -> str:
    """What went wrong, without the place in Zenoh's source."""
    return str(error).split(" at /", maxsplit=1)[0].strip()
