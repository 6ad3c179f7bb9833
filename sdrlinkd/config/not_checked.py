"""Lists what `--check` cannot verify before the radio is opened."""

from sdrlinkd.config.backends import backend_of
from sdrlinkd.config.schema import Config


def unchecked(config: Config) -> list[str]:
    """What cannot be checked without the radio, a text each; may be empty. Raises ConfigError."""
    radio, policy = backend_of(config), config.access.policy
    found = radio.unchecked(config.backend_settings) if radio is not None else []
    if config.backend == "gnuradio":
        found = ["whether the flowgraph answers (it is not queried)"]
    if policy not in ("none", "auto") and found:
        found = [*found, f'whether access.policy "{policy}" fits what the radio can do']
    return found
