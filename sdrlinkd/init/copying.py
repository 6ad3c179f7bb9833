"""Another robot's configuration, from that of a daemon that runs."""

import re

import msgspec
import tomli_w

from sdrlinkd.config import Config
from sdrlinkd.init.team import REGISTRY

_DIGITS = re.compile(r"\d+(?=\D*$)")


def copy_of(config: Config, number: int) -> str:
    """`config` for robot `number`, as TOML: what differs from the defaults.

    Sockets are not copied: they are each daemon's own.
    """
    from_namespace = config.robot_id < 0
    copy = msgspec.structs.replace(
        config,
        namespace=_DIGITS.sub(str(number), config.namespace),
        robot_id=-1 if from_namespace else number,
        registry=REGISTRY,
        bus=msgspec.structs.replace(config.bus, runtime_dir=""),
    )
    changed = _changed(copy, Config()) | {"namespace": copy.namespace, "registry": REGISTRY}
    top = {key: value for key, value in changed.items() if not isinstance(value, dict)}
    tables = {key: value for key, value in changed.items() if isinstance(value, dict)}
    return (
        f"# Robot {number}, copied from a running daemon by `sdrlinkctl init`.\n"
        f"{tomli_w.dumps(top | tables)}"
    )


def _changed(struct: msgspec.Struct, default: msgspec.Struct) -> dict[str, object]:
    found: dict[str, object] = {}
    for key in struct.__struct_fields__:
        value, usual = getattr(struct, key), getattr(default, key)
        if value == usual or value is None:
            continue
        if isinstance(value, msgspec.Struct):
            found[key] = _changed(value, usual if usual is not None else type(value)())
        elif isinstance(value, dict):
            found[key] = {
                name: _changed(each, type(each)()) if isinstance(each, msgspec.Struct) else each
                for name, each in value.items()
            }
        else:
            found[key] = value
    return found
