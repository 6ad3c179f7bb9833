"""PDU links: what carries PDUs between nodes, behind one seam."""

from random import Random

from sdrlinkd.config import Config
from sdrlinkd.pdulink.base import Heard, Opportunity, PduLink, PduListener
from sdrlinkd.pdulink.direct import DirectLink
from sdrlinkd.pdulink.impairment import Arrival, Impairment

__all__ = [
    "Arrival",
    "DirectLink",
    "Heard",
    "Impairment",
    "Opportunity",
    "PduLink",
    "PduListener",
    "make_pdu_link",
]


def make_pdu_link(config: Config, rng: Random) -> PduLink:
    """The PDU link that `config.backend` names."""
    return DirectLink(config.direct, config.link.pdu_size, rng)
