"""Radios as access policies see them."""

from sdrlinkd.link import AccessParams, PduLinkTraits

RATE = 5e6
LOOK_S = 0.001
"""Length of a block."""
DETECT_S = 128 / RATE
AHEAD_S = 0.005
"""How long before the end of its last burst a node requests the next one."""

_SHARED = PduLinkTraits(
    kind="ether",
    senses=True,
    shares_air=True,
    turnaround_s=50e-6,
    detect_s=DETECT_S,
    gap_s=32 / RATE,
    overhead_s=0.0002,
)
LOCKSTEP = _SHARED._replace(is_lockstep=True, lead_s=50e-6 + 17 / RATE, react_s=LOOK_S)
PACED = _SHARED._replace(lead_s=50e-6 + 0.003, react_s=LOOK_S + 0.002, ahead_s=AHEAD_S)

TX_WINDOWS = _SHARED._replace(
    kind="soapy", turnaround_s=0.08, index_error_s=0.001, lead_s=0.15, react_s=0.02
)
"""Traits of a radio with a slow T/R switch."""


def params(policy, nodes, **more):
    """Access parameters."""
    return AccessParams(policy=policy, nodes=list(nodes), **{"force": True, **more})
