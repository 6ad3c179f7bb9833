"""Makes the hub of a scenario, which simulates its air."""

from pathlib import Path

from backends import AirParams, BackendError, EtherHub, World
from sdrlinkd.errors import UserError
from sdrlinkd.lab.scenario import Scenario, outages_of


def make_hub(scenario: Scenario | None, directory: Path, traces: Path | None) -> EtherHub:
    """The hub of `scenario`; None: of an air on which all robots hear each other.

    The modem should be compiled before; otherwise the air would wait for that at the first delayed
    burst. Raises UserError if the folder cannot be used.
    """
    try:
        if scenario is None:
            air = AirParams()
            return EtherHub(directory, air, World(air, {}), {})
        return EtherHub(
            directory,
            scenario.air,
            scenario.world(outages_of(scenario, traces)),
            scenario.radios,
            paced=scenario.pace == "realtime",
            until_s=scenario.until_s,
            seed=scenario.seed,
        )
    except BackendError as error:
        raise UserError(str(error)) from None
