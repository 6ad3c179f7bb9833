"""The bridge's settings as parameters of its node, with their descriptions."""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from rcl_interfaces.msg import ParameterDescriptor, SetParametersResult

from sdrlink_ros.names import is_rate
from sdrlink_ros.settings import Settings


class _Parameter(NamedTuple):
    name: str
    field: str
    help: str
    is_fixed: bool = False


LONGEST_TIMEOUT_S = 60.0
_PATTERNS = "Names or patterns with *, such as /camera/*."
_PARAMETERS = (
    _Parameter("allow", "allow", "Topics of this robot for the others. A pattern other than /* "
               f"also takes in what is left out by default: images, point clouds. {_PATTERNS}"),
    _Parameter("deny", "deny", f"Topics that stay here; they win over allow. {_PATTERNS}"),
    _Parameter("commands", "commands", "Topics that others command and that are never sent the "
               f"other way. {_PATTERNS}"),
    _Parameter("eager", "eager", "Topics that are sent even if nobody is known to subscribe to "
               f"them. {_PATTERNS}"),
    _Parameter("rates", "rates", "How often a message a second of others' topics is enough here, "
               "as in /robot_2/scan:=2 or *:=10; the first that fits counts."),
    _Parameter("restamp", "restamp", "Topics of others, by their names here or at their robot, "
               f"whose header gets the time of publication by this host's clock. {_PATTERNS}"),
    _Parameter("rx_format", "rx_format", "Prefix of others' topics, with {src} for the robot's id.",
               True),
    _Parameter("tf.merge", "tf_merge", "Publish the transforms of others on /tf and /tf_static, "
               "too. Give each robot's frames a prefix: [tf] prefix in its sdrlinkd.toml."),
    _Parameter("services.allow", "services_allow", "Services and actions of this robot that others "
               f"may call. {_PATTERNS}"),
    _Parameter("services.timeout_s", "services_timeout_s", "Time in s that a call may take, 0 to "
               "60; 0: 25 round trips, and at least 5 s. Results of actions have 15 minutes."),
)  # fmt: skip


class Parameters:
    """The settings as parameters of a node; `settings` are those in force.

    `changed` is called after a change.
    """

    def __init__(self, node: Any, changed: Callable[[], None]) -> None:  # noqa: ANN401
        self.settings = Settings()
        self._changed = changed
        for each in _PARAMETERS:
            default = getattr(self.settings, each.field)
            descriptor = ParameterDescriptor(
                description=each.help, read_only=each.is_fixed, dynamic_typing=True
            )
            given = list(default) if isinstance(default, tuple) else default
            value = node.declare_parameter(each.name, given, descriptor).value
            self.settings = self._with(each, value)
        node.add_on_set_parameters_callback(self._set)

    def _set(self, parameters: Sequence[Any]) -> SetParametersResult:
        settings, known = self.settings, {each.name: each for each in _PARAMETERS}
        try:
            for parameter in parameters:
                if parameter.name in known:
                    self.settings = self._with(known[parameter.name], parameter.value)
        except ValueError as error:
            self.settings = settings
            return SetParametersResult(successful=False, reason=str(error))
        self._changed()
        return SetParametersResult(successful=True)

    def _with(self, parameter: _Parameter, value: Any) -> Settings:  # noqa: ANN401
        """The settings with another value. Raises ValueError if it has the wrong type."""
        default = getattr(Settings(), parameter.field)
        fitting: Any = value
        if isinstance(default, tuple):
            fitting, allowed = _patterns(value), "a list of names or patterns"
        elif isinstance(default, float):
            allowed = f"0 to {LONGEST_TIMEOUT_S:g} s"
            is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
            is_in = is_number and 0 <= value <= LONGEST_TIMEOUT_S
            fitting = float(value) if is_in else None
        else:
            allowed = "true or false" if isinstance(default, bool) else "a text"
        if parameter.field == "rates" and fitting and not all(map(is_rate, fitting)):
            fitting, allowed = None, "a list of NAME:=HZ, such as /robot_2/scan:=2"
        if not isinstance(fitting, type(default)):
            raise ValueError(  # noqa: TRY004
                f"{parameter.name}: got {value!r}; allowed: {allowed}"
            )
        return self.settings._replace(**{parameter.field: fitting})


def _patterns(value: Any) -> "tuple[str, ...] | None":  # noqa: ANN401
    """The patterns in a parameter's value; None if it is no list of text."""
    # ROS cannot tell an empty list of text from one of octets.
    if value is None or value == b"":
        return ()
    if not isinstance(value, (list, tuple)) or not all(isinstance(each, str) for each in value):
        return None
    return tuple(filter(None, value))
