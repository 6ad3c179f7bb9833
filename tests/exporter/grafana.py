"""Checks dashboards against the types of Grafana's own SDK, which are made from Grafana's schema.

The SDK drops what it does not know and takes values of any type, so both are looked for here.
"""

import enum
import json
import typing

from grafana_foundation_sdk.cog.encoder import JSONEncoder
from grafana_foundation_sdk.cog.plugins import register_default_plugins
from grafana_foundation_sdk.models.dashboard import Dashboard

register_default_plugins()


def mistakes(text):
    """What is wrong with a dashboard's JSON, in words; empty: nothing."""
    given = json.loads(text)
    made = Dashboard.from_json(given)
    return [*_unknown(given, _plain(made), "dashboard"), *_wrong(made, Dashboard, "dashboard")]


def queries(text):
    """{where: expression} of all panels, variables and annotations of a dashboard."""
    given = json.loads(text)
    found = {}
    for panel in given["panels"]:
        for target in panel.get("targets", ()):
            found[f"{panel['title']} {target['refId']}"] = target["expr"]
    for each in given["templating"]["list"]:
        if each["type"] == "query":
            found[f"variable {each['name']}"] = each["query"]
    for each in given["annotations"]["list"]:
        found[f"annotation {each['name']}"] = each["expr"]
    return found


def _unknown(given, known, path):
    """What Grafana's types do not have."""
    if isinstance(given, dict) and isinstance(known, dict):
        for key, value in given.items():
            if key not in known:
                yield f"{path}.{key}: unknown"
            else:
                yield from _unknown(value, known[key], f"{path}.{key}")
    elif isinstance(given, list) and isinstance(known, list) and len(given) == len(known):
        for at, pair in enumerate(zip(given, known, strict=True)):
            yield from _unknown(*pair, f"{path}[{at}]")
    elif given != known:
        yield f"{path}: got {given}, understood as {known}"


def _wrong(value, hint, path):
    """Values of other types than Grafana's."""
    origin, arguments = typing.get_origin(hint), typing.get_args(hint)
    if origin is typing.Union:
        fitting = [each for each in arguments if isinstance(each, type) and type(value) is each]
        found = [list(_wrong(value, each, path)) for each in fitting or arguments]
        if all(found):
            yield from found[0]
        return
    if isinstance(value, dict) and hasattr(hint, "from_json"):
        # The SDK leaves some parts as they came.
        made = hint.from_json(value)
        yield from _unknown(value, _plain(made), path)
        value = made
    allowed = _allowed(value, hint)
    if allowed:
        yield f"{path}: got {value!r}; allowed: {allowed}"
    elif origin in (list, dict):
        for key, item in value.items() if origin is dict else enumerate(value):
            yield from _wrong(item, arguments[-1], f"{path}[{key}]")
    elif type(value).__module__.startswith("grafana_foundation_sdk.models"):
        for name, kind in typing.get_type_hints(type(value)).items():
            yield from _wrong(getattr(value, name), kind, f"{path}.{name}")


def _allowed(value, hint):
    """What a value must be, in words; empty: it is."""
    origin = typing.get_origin(hint)
    if origin is typing.Literal:
        allowed = typing.get_args(hint)
        return "" if value in allowed else allowed
    if isinstance(hint, type) and issubclass(hint, enum.Enum):
        allowed = [each.value for each in hint]
        return "" if value in allowed else allowed
    kinds = {float: int | float}.get(hint, origin or hint)
    is_flag = isinstance(value, bool) and hint in (int, float)
    return "" if isinstance(value, kinds) and not is_flag else getattr(hint, "__name__", hint)


def _plain(made):
    return json.loads(json.dumps(made, cls=JSONEncoder))
