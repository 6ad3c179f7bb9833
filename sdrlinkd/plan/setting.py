"""What a configuration says of the air."""

from sdrlinkd.config import Config
from sdrlinkd.errors import UserError
from sdrlinkd.link import Qos
from sdrlinkd.modem import Airtimes
from sdrlinkd.plan.model import Setting

GAP_SAMPLES = 5
REACTION_S = 0.002
DETECT_SAMPLES = 128


def setting_of(config: Config, robots: int, turnaround_s: float) -> Setting:
    """For `robots` of which all send the same. Raises UserError."""
    if config.backend == "direct":
        raise UserError(
            'backend: got "direct", which has no air to plan for; allowed: a backend with a radio'
        )
    modem, access = config.modem, config.access
    airtimes = Airtimes(modem, config.link.pdu_size)
    policy = access.policy if robots > 1 else "none"
    detect_s = DETECT_SAMPLES / modem.rate_hz
    slot_s = turnaround_s + modem.block_s + REACTION_S + detect_s
    minislot_s = access.minislot_s or slot_s
    pause_s, share, turn_s = dict.fromkeys(Qos, 0.0), 1.0, 0.0
    longest_s = airtimes.longest_s()[modem.mcs]
    if policy == "minislot":
        mean = minislot_s * (1 + (robots - 1) / 2)
        pause_s = {qos: mean + (minislot_s * robots if qos > Qos.LATENCY else 0.0) for qos in Qos}
    elif policy == "csma":
        step_s = access.slottime_s or slot_s
        pause_s = dict.fromkeys(Qos, (access.dwait_s or step_s) + step_s / (2 * access.persist))
    elif policy == "tdma":
        guard_s = access.guard_s or turnaround_s + 2e-4
        tdma_s = access.slot_s or 2 * longest_s + guard_s
        share = (tdma_s - guard_s) / (tdma_s * robots)
        turn_s = tdma_s * (robots - 1)
    return Setting(
        airtimes, config.link.pdu_size, modem.mcs, longest_s, config.classes, robots, policy,
        GAP_SAMPLES / modem.rate_hz, modem.block_s + REACTION_S + turnaround_s, pause_s, share,
        turn_s,
    )  # fmt: skip
