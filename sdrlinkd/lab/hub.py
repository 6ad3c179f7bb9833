"""Makes the hub of a scenario, which simulates its air."""

from pathlib import Path

from backends import AirParams, BackendError, EtherHub, World, hub_at
from sdrlinkd.errors import UserError
from sdrlinkd.lab.scenario import Scenario, outages_of


def make_hub(
    scenario: Scenario | None, directory: Path, traces: Path | None, listen: str = ""
) -> EtherHub:
    """For `scenario`, or an air of which nothing is known but that all hear each other.

    The modem should have been compiled: else the first burst that is delayed would have the air
    wait for it. With `listen`, HOST:PORT, radios of other computers may join. Raises UserError when
    the folder or the port cannot be had.
    """
    try:
        where = hub_at(listen, "--listen") if listen else None
        if scenario is None:
            air = AirParams()
            return EtherHub(directory, air, World(air, {}), {}, listen=where)
        return EtherHub(
            directory,
            scenario.air,
            scenario.world(outages_of(scenario, traces)),
            scenario.radios,
            paced=scenario.pace == "realtime",
            until_s=scenario.until_s,
            seed=scenario.seed,
            listen=where,
        )
    except BackendError as error:
        raise UserError(str(error)) from None
