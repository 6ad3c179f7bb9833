"""`routes`: the screen, the picture, and what it says where there is nothing to show."""

import pytest

from sdrlinkd.cli.pictures import draw_routes
from sdrlinkd.cli.screens import routes_screen
from sdrlinkd.reports import FlowReport, RobotLinksReport, RoutesReport
from tests.cli.pictures import assert_stored, drawn

TEAM = RoutesReport(
    robots=[
        RobotLinksReport(id=1, told_s_ago=0.2, hears={2: 0.998, 3: 0.61}),
        RobotLinksReport(id=2, told_s_ago=3.0, hears={1: 1.0, 3: 0.97, 4: 0.92}),
        RobotLinksReport(id=3, told_s_ago=1.0, hears={1: 0.55, 2: 0.99, 4: 0.3}),
        RobotLinksReport(id=4, told_s_ago=9.0, hears={2: 0.9, 3: 0.2}),
    ],
    flows=[
        FlowReport(src=1, dst=255, forwarded_by=[2], went_around=0),
        FlowReport(src=1, dst=4, forwarded_by=[2], went_around=1),
        FlowReport(src=3, dst=4, forwarded_by=[], went_around=0),
    ],
    going_around=[3],
)


def test_the_screen_is_the_stored_one():
    assert_stored("routes", drawn(*routes_screen(1, TEAM)))


def test_without_routes_it_says_how_to_get_them():
    assert 'relay.policy = "auto"' in drawn(*routes_screen(1, RoutesReport()))


@pytest.mark.parametrize("width", [80, 100, 140])
def test_a_large_team_fits(width):
    ids = range(1, 33)
    robots = [RobotLinksReport(id=i, told_s_ago=0.0, hears=dict.fromkeys(ids, 0.5)) for i in ids]
    lines = drawn(*routes_screen(1, RoutesReport(robots=robots)), width=width).splitlines()
    assert max(map(len, lines)) <= width


@pytest.mark.slow
def test_the_picture(tmp_path):
    path = tmp_path / "routes.png"
    draw_routes(1, TEAM, path)
    assert path.stat().st_size > 2000


def test_a_picture_of_another_kind_is_refused_in_a_sentence(ctl, tmp_path):
    code, _, err = ctl("routes", "--runtime-dir", tmp_path, "--picture", "routes.gif")
    assert code == 2
    assert "--picture: got routes.gif; allowed: names that end in .png" in err
