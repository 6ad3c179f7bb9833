"""The configuration of a plain Zenoh node."""

import json

import zenoh


def configured(config: zenoh.Config | None = None, **settings: object) -> zenoh.Config:
    """A node that finds others by its endpoints alone; `mode`, and `connect` or `listen`."""
    config = zenoh.Config() if config is None else config
    for key, value in settings.items():
        name = key if key == "mode" else f"{key}/endpoints"
        config.insert_json5(name, json.dumps(value))
    config.insert_json5("scouting/multicast/enabled", "false")
    return config
