"""The worst case of a loop, from the paper's numbers of hops."""

from typing import NamedTuple

from benchmarks.peers.pound.rtwmp.frames import AUTHORIZATION, HEADER, MESSAGE, TOKEN
from benchmarks.peers.pound.rtwmp.params import Params


class LoopBound(NamedTuple):
    """The most hops of each phase, and the most time of a loop in s."""

    tokens: int
    authorizations: int
    messages: int
    seconds: float


def loop_bound(n_nodes: int, octets: int, params: Params) -> LoopBound:
    """(2N - 3) tokens and (N - 1) authorizations and messages of `octets`, if nothing is lost.

    A message that is the most important of the network waits for at most the loop under way: it is
    delivered by the end of the loop after that.
    """
    tokens = 2 * n_nodes - (2 if params.returns else 3)
    hops = n_nodes - 1
    token_s = params.hop_s(HEADER.size + TOKEN.size + n_nodes * n_nodes)
    authorization_s = params.hop_s(HEADER.size + AUTHORIZATION.size)
    message_s = params.hop_s(HEADER.size + MESSAGE.size + min(octets, params.part_octets))
    seconds = tokens * token_s + hops * (authorization_s + message_s)
    return LoopBound(tokens, hops, hops, seconds)
