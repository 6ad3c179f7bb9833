"""The live screen: its appearance at two sizes, its keys, and a daemon that goes and returns."""

from io import StringIO

import msgspec
import pytest
from rich.console import Console
from textual.widgets import DataTable, Input, Static

from sdrlinkd.cli.top.dialogs import Explanation, PolicyForm
from sdrlinkd.cli.top.live import TopApp
from sdrlinkd.client import RefusedError
from tests.cli.pictures import assert_stored
from tests.cli.snapshots import SNAPSHOT, busy
from tests.laws import one_in


class Asked:
    """A fake control socket with preset answers."""

    def __init__(self):
        self.requests = []

    def __call__(self, verb, arguments):
        self.requests.append((verb, arguments))
        if verb == "why":
            return {"why": ["odom: class latency, priority 90, to everyone", "2 queued"]}
        if arguments.get("qos") == "fast":
            raise RefusedError("refused", 'qos: got "fast"; allowed: one of "bulk", "default"')
        changes = {key: value for key, value in arguments.items() if key != "topic"}
        return {"topic": "odom", "old": dict.fromkeys(changes, 0), "new": changes}


def make_app(asked=None):
    """An app whose snapshots are set by hand."""
    return TopApp(lambda: None, asked or Asked(), lambda: "waiting for sdrlinkd in /run", 0.0)


def text_of(app):
    """What the terminal shows, by Textual's own renderer."""
    width, height = app.size
    console = Console(
        file=StringIO(), width=width, height=height, record=True, force_terminal=True,
        legacy_windows=False,
    )  # fmt: skip
    # Textual has a picture as its public form, and no text.
    console.print(app.screen._compositor.render_update(full=True))  # noqa: SLF001
    lines = console.export_text(styles=False).splitlines()
    return "".join(f"{line.rstrip()}\n" for line in lines)


def keys_of(table):
    """(source, name) of each row, in order."""
    return [tuple(key.value.split(" ", 1)) for key in table.rows]


def selected_in(table):
    """The key of the row with the cursor."""
    return table.coordinate_to_cell_key(table.cursor_coordinate).row_key.value


async def shown(pilot, moments):
    for moment in moments:
        pilot.app.show(moment)
    await pilot.pause()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("size", "name"), one_in(2, [((80, 24), "top"), ((140, 40), "top-140x40")])
)
async def test_the_screen_is_the_stored_one(size, name):
    async with make_app().run_test(size=size) as pilot:
        await shown(pilot, [busy(at) for at in range(300)])
        text = text_of(pilot.app)
    lines = text.splitlines()
    assert len(lines) <= size[1]
    assert max(map(len, lines)) <= size[0]
    assert_stored(name, text)


async def test_of_a_quiet_daemon_all_is_seen():
    async with make_app().run_test(size=(80, 24)) as pilot:
        await shown(pilot, [SNAPSHOT])
        text = text_of(pilot.app)
    verdict = "DEGRADED, sealed: robot 2 has a different registry"
    for part in (verdict, "/robot_1/odom", "/rx_robot_2/odom", "/imu", "15.5", "SNR dB"):
        assert part in text


@pytest.mark.slow
async def test_a_daemon_that_goes_is_waited_for_and_comes_back():
    async with make_app().run_test(size=(80, 24)) as pilot:
        verdict = pilot.app.query_one("#verdict", Static)
        await shown(pilot, [None])
        assert "waiting for sdrlinkd" in text_of(pilot.app)
        await shown(pilot, [SNAPSHOT, None, None])
        await pilot.press("s")
        assert "waiting for sdrlinkd in /run" in text_of(pilot.app)
        assert "/robot_1/odom" in text_of(pilot.app)
        await shown(pilot, [SNAPSHOT])
        assert "DEGRADED" in str(verdict.render())


@pytest.mark.slow
async def test_the_daemon_is_asked_again_and_again():
    looks = iter([SNAPSHOT, None, busy()])
    app = TopApp(lambda: next(looks, busy()), Asked(), lambda: "waiting", 0.01)
    async with app.run_test(size=(80, 24)) as pilot:
        while "5 more reasons" not in text_of(app):
            await pilot.pause(0.01)


@pytest.mark.slow
async def test_rows_are_sorted_and_searched():
    app = make_app()
    async with app.run_test(size=(140, 40)) as pilot:
        await shown(pilot, [busy()])
        table = app.query_one(DataTable)
        assert table.row_count == 15 + 24
        await pilot.press("s")
        names = [name for _, name in keys_of(table)]
        assert names == sorted(names)
        await pilot.press("slash", *"topic_9")
        assert keys_of(table) == [("None", "/robot_1/topic_9")]
        await pilot.press("enter")
        assert isinstance(app.focused, DataTable)
        await pilot.press("escape")
        assert table.row_count == 39
        await pilot.press("slash", *"robot 3", "enter")
        assert {source for source, _ in keys_of(table)} == {"3"}


async def test_the_selected_topic_stays_selected():
    app = make_app()
    async with app.run_test(size=(80, 24)) as pilot:
        await shown(pilot, [busy()])
        table = app.query_one(DataTable)
        first = selected_in(table)
        await pilot.press("down", "down")
        before = selected_in(table)
        assert before != first
        await pilot.press("s")
        assert selected_in(table) == before
        await shown(pilot, [busy(1)])
        assert selected_in(table) == before


@pytest.mark.slow
async def test_why_is_told_of_the_selected_topic():
    asked = Asked()
    app = make_app(asked)
    async with app.run_test(size=(80, 24)) as pilot:
        await shown(pilot, [SNAPSHOT])
        await pilot.press("w")
        await pilot.pause()
        assert asked.requests == [("why", {"topic": "/robot_1/odom"})]
        assert isinstance(app.screen, Explanation)
        assert "class latency, priority 90" in text_of(app)
        await pilot.press("x")
        assert not isinstance(app.screen, Explanation)
        # Messages from another robot are explained there.
        await pilot.press("s", "down", "down", "down", "w")
        await pilot.pause()
        assert "robot 2 sends it" in text_of(app)
        assert len(asked.requests) == 1


@pytest.mark.slow
async def test_a_policy_is_changed_and_what_is_refused_is_shown():
    asked = Asked()
    app = make_app(asked)
    async with app.run_test(size=(80, 24)) as pilot:
        await shown(pilot, [SNAPSHOT])
        await pilot.press("p")
        await pilot.pause()
        assert isinstance(app.screen, PolicyForm)
        app.screen.query_one("#qos", Input).value = "fast"
        await pilot.press("enter")
        await pilot.pause()
        assert 'qos: got "fast"; allowed' in text_of(app)
        app.screen.query_one("#qos", Input).value = "bulk"
        app.screen.query_one("#lifespan_s", Input).value = "300ms"
        app.screen.query_one("#priority", Input).value = "high"
        await pilot.press("enter")
        await pilot.pause()
        assert "priority: got high; allowed: a whole number" in text_of(app)
        app.screen.query_one("#priority", Input).value = "90"
        await pilot.press("enter")
        await pilot.pause()
        assert not isinstance(app.screen, PolicyForm)
        assert asked.requests[-1] == (
            "set", {"topic": "/robot_1/odom", "qos": "bulk", "priority": 90, "lifespan_s": 0.3},
        )  # fmt: skip


async def test_help_names_every_key():
    async with make_app().run_test(size=(80, 24)) as pilot:
        await pilot.press("question_mark")
        text = text_of(pilot.app)
    for key in ("w, Enter", "p ", "s ", "/", "q, Ctrl-C"):
        assert key in text


@pytest.mark.parametrize("key", ["q", "ctrl+c"])
async def test_it_ends(key):
    async with make_app().run_test(size=(80, 24)) as pilot:
        await shown(pilot, [SNAPSHOT])
        await pilot.press(key)
    assert pilot.app.return_code == 0


async def test_a_daemon_without_anything_is_shown():
    link = msgspec.structs.replace(SNAPSHOT.link, topics=[], received=[], neighbors=[])
    async with make_app().run_test(size=(80, 24)) as pilot:
        await shown(pilot, [msgspec.structs.replace(SNAPSHOT, link=link)])
        await pilot.press("w", "p", "s")
        assert "robot 1 (robot_1)" in text_of(pilot.app)


@pytest.mark.slow
async def test_an_answer_that_comes_when_it_has_ended_is_dropped():
    app = make_app()
    async with app.run_test(size=(80, 24)) as pilot:
        await shown(pilot, [SNAPSHOT])
        await pilot.press("q")
    app.show(busy())
    app.show(None)
