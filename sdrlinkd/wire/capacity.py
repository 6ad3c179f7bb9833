"""The arithmetic of a PDU: how many bytes fit (paper section 5.2).

`pdu_size` is the paper's P_max, `n` its E (entries in a PDU), `k` its k_i (payload bytes of an
entry). All results are bytes.
"""

HEADER_SIZE = 5
ENTRY_HEADER_SIZE = 5
CRC_SIZE = 2
MAX_ENTRIES = 15
MAX_FRAGMENTS = 255
MIN_PDU_SIZE = 32
MAX_PDU_SIZE = 2047


def entry_budget(pdu_size: int, n: int) -> int:
    """Bytes left for `n` entry records, including their headers: B = P_max − (7 + ⌈n/2⌉)."""
    return pdu_size - (HEADER_SIZE + (n + 1) // 2 + CRC_SIZE)


def equal_payload(pdu_size: int, n: int) -> int:
    """Payload of each of `n` equal entries: k*(n) = ⌊B/n⌋ − 5; k*(1) = P_max − 13."""
    return entry_budget(pdu_size, n) // n - ENTRY_HEADER_SIZE


def pad_length(pdu_size: int, payload_sizes: list[int]) -> int:
    """Zero bytes before the CRC, L_pad (paper section 5.3); negative if the entries do not fit."""
    n = len(payload_sizes)
    return entry_budget(pdu_size, n) - sum(ENTRY_HEADER_SIZE + k for k in payload_sizes)


def max_message_size(pdu_size: int) -> int:
    """Largest message that 255 single-entry fragments can carry."""
    return MAX_FRAGMENTS * equal_payload(pdu_size, 1)


def fragment_count(size: int, k: int) -> int:
    """Number of fragments of at most `k` bytes for `size` bytes; an empty message has one."""
    return max(1, -(-size // k))
