"""The figures in docs/limits.md are those of the code."""

import re
from pathlib import Path

from sdrlinkd.config import Config
from sdrlinkd.wire import MAX_PDU_SIZE, MIN_PDU_SIZE, max_message_size

PAGE = (Path(__file__).parents[2] / "docs/limits.md").read_text()


def test_message_sizes_are_those_of_the_wire_format():
    told = {
        int(pdu_size): int(size.replace(" ", ""))
        for size, pdu_size in re.findall(r"(\d+ \d+) B at (\d+)", PAGE)
    }
    assert len(told) == 3
    assert told == {pdu_size: max_message_size(pdu_size) for pdu_size in told}
    assert f"{MIN_PDU_SIZE} to {MAX_PDU_SIZE} B" in PAGE


def test_every_key_of_the_page_is_one_of_the_configuration():
    keys = re.findall(r"`([a-z]+(?:\.[a-z_]+)+)`", PAGE)
    assert len(keys) > 8
    for key in keys:
        part = Config()
        for word in key.split("."):
            part = getattr(part, word)


def test_defaults_are_those_of_the_configuration():
    config = Config()
    assert f"{config.queue.max_messages // 1000} 000, {config.queue.max_bytes >> 20} MiB" in PAGE
    lifespans = (config.classes.urgent.lifespan_s, config.classes.latency.lifespan_s)
    assert "| {:g} s, {:g} s |".format(*lifespans) in PAGE
    assert f"| {config.reassembly.timeout_s:g} s | `reassembly.timeout_s` |" in PAGE
    assert f"| {config.link.receipt_s:g} s | `link.receipt_s` |" in PAGE
    memory = (config.reassembly.source_bytes >> 20, config.reassembly.total_bytes >> 20)
    assert "{} MiB a source, {} MiB in all".format(*memory) in PAGE
