"""The reference page of the metrics."""

from sdrlinkd.exporter.families import INFO, RUNTIME_DIR, families
from sdrlinkd.exporter.names import PREFIX

INTRODUCTION = f"""\
# Metrics

`sdrlinkctl exporter` serves these to Prometheus. They are the [fields of the snapshot](snapshot.md)
in base units. Each has the labels `node`, the robot's id, and `namespace`, and those given in
braces. A state has a sample for each of its values, in a label of the metric's own name: 1 for the
value in force.

`{PREFIX}_up` {{{RUNTIME_DIR}}}
:   Whether the daemon answers. (gauge)

`{PREFIX}_info` {{{", ".join([*INFO.values(), RUNTIME_DIR])}}}
:   Version and kind of the daemon. (always 1)
"""


def metrics_page() -> str:
    """The page in Markdown: an entry for each family."""
    parts = [INTRODUCTION]
    for family in families():
        suffix = "_total" if family.kind == "counter" else ""
        labels = f" {{{', '.join(family.labels)}}}" if family.labels else ""
        kind = f"state: {' | '.join(family.states)}" if family.states else family.kind
        parts.append(f"`{PREFIX}_{family.name}{suffix}`{labels}\n:   {family.help} ({kind})\n")
    return "\n".join(parts)
