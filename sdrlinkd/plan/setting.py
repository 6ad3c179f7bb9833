"""What a configuration says of the air."""

from random import Random

import msgspec

from backends import Capabilities
from sdrlinkd.config import Config
from sdrlinkd.errors import UserError
from sdrlinkd.link import Qos, make_access
from sdrlinkd.modem import Airtimes, carrier_traits
from sdrlinkd.plan.model import Setting


def setting_of(config: Config, robots: int, turnaround_s: float) -> Setting:
    """For `robots` of which all send the same. Raises UserError, ConfigError."""
    if config.backend in ("direct", "gnuradio"):
        raise UserError(
            f'backend: got "{config.backend}", which has no air to plan for; allowed: a backend '
            "with a radio"
        )
    modem, pdu_size = config.modem, config.link.pdu_size
    airtimes = Airtimes(modem, pdu_size)
    radio = Capabilities(
        receives=True, transmits=True, full_duplex=False, timestamps=True, paced=True,
        turnaround_s=turnaround_s, block_s=modem.block_s,
    )  # fmt: skip
    traits = carrier_traits("radio", radio, modem, airtimes)
    longest_s = traits.longest_burst_s[modem.mcs]
    # Robot 1 stands for all.
    nodes = list(range(1, robots + 1))
    policy = config.access.policy if robots > 1 else "none"
    params = msgspec.structs.replace(config.access, policy=policy, nodes=nodes)
    access = make_access(params, 1, traits, longest_s, Random(0))
    return Setting(
        airtimes, pdu_size, modem.mcs, longest_s, config.classes, robots, policy, traits.gap_s,
        traits.lead_s + traits.react_s, {qos: access.mean_wait_s(qos) for qos in Qos},
        access.share, access.round_s if policy == "tdma" else 0.0,
    )  # fmt: skip
