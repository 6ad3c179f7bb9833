"""The screen of `routes`: who hears whom, and who forwards what."""

from collections.abc import Sequence

from rich.console import RenderableType
from rich.text import Text

from sdrlinkd.reports import EVERYONE, FlowReport, RoutesReport
from sdrlinkd.tables import NOTHING, FittedTable, figure, words

WEAK = 0.9
"""Share of PDUs below which a link is marked."""


def routes_screen(own: int, routes: RoutesReport) -> list[RenderableType]:
    """The links of the team as a matrix, and what goes through robot `own`."""
    if not routes.robots:
        return [Text('no links known; routes are found with relay.policy = "auto"')]
    parts: list[RenderableType] = [_links(own, routes), _flows(own, routes.flows)]
    if routes.going_around:
        names = ", ".join(str(robot) for robot in routes.going_around)
        parts.append(Text(f"does not answer, so nothing goes through it: robot {names}", "yellow"))
    return parts


def _links(own: int, routes: RoutesReport) -> FittedTable:
    ids = sorted(each.id for each in routes.robots)
    table = FittedTable(
        "PDUs that arrive directly, in %",
        (words("hears", least=5), *(figure(f"← {robot}", rank) for rank, robot in enumerate(ids))),
    )
    for each in sorted(routes.robots, key=lambda robot: robot.id):
        cells = [_share(each.hears.get(other), is_self=other == each.id) for other in ids]
        name = f"{each.id} (this)" if each.id == own else str(each.id)
        table.add(name, *cells)
    return table


def _share(share: float | None, *, is_self: bool) -> Text:
    if is_self:
        return Text("")
    if share is None:
        return Text(NOTHING, style="dim")
    return Text(f"{100 * share:.0f}", style="yellow" if share < WEAK else "")


def _flows(own: int, flows: Sequence[FlowReport]) -> FittedTable:
    table = FittedTable(
        f"what robot {own} sends and forwards",
        (
            words("from", least=4),
            words("to", least=4),
            words("forwarded by"),
            figure("rerouted", 1),
        ),
    )
    for flow in flows:
        table.add(
            str(flow.src),
            "all" if flow.dst == EVERYONE else str(flow.dst),
            ", ".join(str(robot) for robot in flow.forwarded_by) or NOTHING,
            str(flow.went_around),
        )
    return table
