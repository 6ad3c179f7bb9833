"""`topics train-dict`: a zstd dictionary for a topic's small messages, from a recording."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from sdrlinkd.cli.topics import topics_app
from sdrlinkd.errors import UserError
from sdrlinkd.units import octets

if TYPE_CHECKING:
    from sdrlinkd.link import Deflated


@topics_app.command("train-dict")
def train_dict(
    bag: Annotated[Path, typer.Argument(help="rosbag2 folder, .mcap, .db3 or .bag")],
    topic: Annotated[str, typer.Argument(help="Topic name in the recording.")],
    out: Annotated[
        Path | None, typer.Option(help="File to write; default: odom.zdict for /odom.")
    ] = None,
    size: Annotated[str, typer.Option(help="Size of the dictionary in bytes.")] = "8k",
) -> None:
    """Train a zstd dictionary on every other message of a recording; test it on the rest."""
    from zstandard import ZstdCompressionDict

    from sdrlinkd.adapters import open_bag
    from sdrlinkd.link import Deflated, train_dictionary

    opened = open_bag(bag)
    try:
        payloads = [each.cdr for each in opened.messages() if each.topic == topic]
        names = [each.name for each in opened.topics()]
    finally:
        opened.close()
    if not payloads:
        raise UserError(f"{topic}: not in {bag}; allowed: {', '.join(names)}")
    try:
        made = train_dictionary(payloads[::2], octets(size, "--size"))
    except ValueError as error:
        raise UserError(
            f"{topic}: no dictionary from {len(payloads)} messages ({error}); allowed: a longer "
            "recording, or a smaller --size"
        ) from None
    rest = payloads[1::2] or payloads
    raw = sum(map(len, rest))
    with_it, without = (_total(Deflated(each), rest) for each in (ZstdCompressionDict(made), None))
    name = topic.strip("/")
    out = out or Path(f"{name.replace('/', '_')}.zdict")
    try:
        out.write_bytes(made)
    except OSError as error:
        raise UserError(f"{out}: cannot be written ({error.strerror})") from None
    typer.echo(
        f"{out}: {len(made)} B from {len(payloads[::2])} messages; {len(rest)} others shrink to "
        f"{100 * with_it / raw:.0f} % of their size with it, {100 * without / raw:.0f} % with zstd "
        "alone"
    )
    key = name if name.isidentifier() else f'"{name}"'
    typer.echo(f'use it with: [topic.{key}] compress = "zstd", dictionary = "{out}", at all robots')


def _total(deflated: "Deflated", payloads: list[bytes]) -> int:
    return sum(len(deflated.shrink(each) or each) for each in payloads)
