"""Makes another robot's configuration from that of a running daemon."""

import re
from pathlib import Path

import msgspec
import tomli_w

from sdrlinkd.config import Config
from sdrlinkd.errors import UserError
from sdrlinkd.init.team import REGISTRY

_LAST_NUMBER = re.compile(r"[0-9]+(?=[^0-9]*$)")


def copy_of(config: Config, own_id: int, number: int) -> str:
    """`config` of robot `own_id`, changed for robot `number`, as TOML without default values.

    Socket paths are not copied, as each daemon has its own. Dictionaries are expected in the file's
    folder, under their own names.
    """
    namespace, told_id = _identity(config, own_id, number)
    copy = msgspec.structs.replace(
        config,
        namespace=namespace,
        robot_id=told_id,
        registry=REGISTRY,
        bus=msgspec.structs.replace(config.bus, runtime_dir=""),
        topic={
            name: msgspec.structs.replace(policy, dictionary=_beside(policy.dictionary))
            for name, policy in config.topic.items()
        },
    )
    changed = _changed(copy, type(copy)()) | {"namespace": copy.namespace, "registry": REGISTRY}
    top = {key: value for key, value in changed.items() if not isinstance(value, dict)}
    tables = {key: value for key, value in changed.items() if isinstance(value, dict)}
    return (
        f"# Robot {number}, copied from a running daemon by `sdrlinkctl init`.\n"
        f"{tomli_w.dumps(top | tables)}"
    )


def dictionaries_of(config: Config) -> dict[str, bytes]:
    """The dictionary files that `copy_of` expects in its folder, by name. Raises UserError."""
    found: dict[str, bytes] = {}
    for name, policy in config.topic.items():
        if not policy.dictionary:
            continue
        key = f"topic.{name}.dictionary"
        try:
            content = Path(policy.dictionary).read_bytes()
        except OSError as error:
            raise UserError(
                f"{key}: {policy.dictionary} of the running daemon is unreadable "
                f"({error.strerror}); allowed: a file that this user may read"
            ) from None
        if found.setdefault(_beside(policy.dictionary), content) != content:
            raise UserError(
                f"{key}: {policy.dictionary} has the same name as another topic's dictionary; "
                "allowed: distinct file names"
            )
    return found


def _identity(config: Config, own_id: int, number: int) -> tuple[str, int]:
    """(namespace, robot_id); a number in the namespace changes only if it is the robot's id."""
    last = _LAST_NUMBER.search(config.namespace)
    if last is None or int(last[0]) != own_id:
        return config.namespace, number
    namespace = config.namespace[: last.start()] + str(number) + config.namespace[last.end() :]
    return namespace, -1 if config.robot_id < 0 else number


def _beside(path: str) -> str:
    return Path(path).name


def _changed(struct: msgspec.Struct, default: msgspec.Struct) -> dict[str, object]:
    found: dict[str, object] = {}
    names = zip(struct.__struct_encode_fields__, struct.__struct_fields__, strict=True)
    for key, name in names:
        value, usual = getattr(struct, name), getattr(default, name)
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
