"""Reads measured outages from logs of received messages."""

import json
from itertools import pairwise
from pathlib import Path

from backends import Outage
from sdrlinkd.errors import UserError

LARGEST = 1 << 62


def read_outages(path: Path, period_s: float, from_s: float) -> list[Outage]:
    """Outages where messages are missing in a log with one message per `period_s`.

    Time 0 is `from_s` into the log. Each line is JSON with `seqnum`, at the top level or in
    `payload`. Raises UserError.
    """
    numbers = sorted(set(_numbers(path)))
    if len(numbers) < 2:
        raise UserError(
            f"{path}: has fewer than two lines with a seqnum; allowed: a log of received "
            "messages, one JSON object per line"
        )
    first = numbers[0]
    outages = []
    for before, after in pairwise(numbers):
        if after - before > 1:
            begin_s = (before + 1 - first) * period_s - from_s
            end_s = (after - first) * period_s - from_s
            if end_s > 0:
                outages.append(Outage(max(0.0, begin_s), end_s))
    return outages


def _numbers(path: Path) -> list[int]:
    try:
        lines = path.read_text(errors="replace").splitlines()
    except OSError as error:
        raise UserError(
            f"{path}: cannot be read ({error.strerror}); give the folder of the logs with --traces"
        ) from None
    numbers = []
    for line in lines:
        try:
            found = json.loads(line)
            number = found["seqnum"] if "seqnum" in found else found["payload"]["seqnum"]
        except (ValueError, KeyError, TypeError, RecursionError):
            # Skip a damaged line.
            continue
        if type(number) is int and 0 <= number <= LARGEST:
            numbers.append(number)
    return numbers
