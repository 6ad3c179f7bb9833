"""The page in a real browser, against a running lab."""

import io
import time

import pytest
from PIL import Image

from sdrlinkd.client import ControlClient
from tests.waiting import wait_for

pytestmark = pytest.mark.long
VIEWS = ("Map", "Link", "Air", "Topics", "What if")


def place(browser, robot):
    """Where a robot is drawn."""
    return browser.all(f'[data-robot="{robot}"]')[0].get_attribute("transform")


def n_colors(png):
    return len(Image.open(io.BytesIO(png)).convert("RGB").getcolors(1 << 24))


def is_planned(browser):
    """Whether a plan is shown; a page that had lost its server for long begins with the map."""
    (shown,) = browser.all(".q-tab[aria-selected=true]")
    if shown.text.lower() != "what if":
        browser.tab("What if")
        browser.press("take the last minute")
    return "of what the channel carries" in browser.text


def n_points(browser):
    """Points of the first line of the first picture."""
    return browser.run(
        "const [chart] = document.querySelectorAll('.sdr-chart');"
        "const series = getElement(chart.id.slice(1)).chart.getOption().series;"
        "return series.length ? series[0].data.length : 0"
    )


def test_the_map_follows_robots_and_shows_both_paths(lab, open_browser):
    browser = open_browser(lab[0])
    for robot in (1, 2):
        first = browser.see(lambda robot=robot: place(browser, robot), f"robot {robot}")
        browser.see(lambda robot=robot, first=first: place(browser, robot) != first, "motion")
    for kind in ("sent", "received"):
        path = browser.see(lambda kind=kind: browser.all(f"polyline.{kind}"), f"path {kind}")[0]
        browser.see(lambda path=path: path.get_attribute("points").count(",") > 20, "its points")
    assert browser.see(lambda: browser.all('[data-link="1-2"]'), "link")
    title = browser.run("return document.querySelector('[data-link] title').textContent")
    assert "robot 1 hears robot 2: 2" in title
    assert "dB" in title


def test_the_map_is_moved_by_mouse_and_by_keys(lab, open_browser):
    browser = open_browser(lab[0])
    browser.see(lambda: place(browser, 1), "robot 1")
    scale = browser.see(lambda: browser.all(".scale text"), "scale")[0].text
    browser.run("document.querySelector('.sdr-map').focus()")
    for _ in range(4):
        browser.press("+")
    browser.see(lambda: browser.all(".scale text")[0].text != scale, "larger")
    browser.press("fit")
    browser.see(lambda: browser.all(".scale text")[0].text == scale, "as before")


@pytest.mark.parametrize("view", VIEWS)
def test_every_view_is_drawn(view, lab, open_browser):
    browser = open_browser(lab[0])
    browser.see(lambda: "OK" in browser.text or "DEGRADED" in browser.text, "verdict")
    browser.tab(view)
    browser.see(lambda: n_colors(browser.picture()) > 40, "a picture")
    if view == "Link":
        browser.see(lambda: len(browser.all(".sdr-chart canvas")) >= 8, "charts")
        # The first update brings all of it, the next ones what is new.
        first = browser.see(lambda: n_points(browser), "lines")
        browser.see(lambda: n_points(browser) >= first + 4, "what is new")
    elif view == "Air":
        browser.see(lambda: " bursts, " in browser.text, "bursts")
        browser.see(lambda: "Last burst: QAM16" in browser.text, "constellation")
    elif view == "Topics":
        browser.see(lambda: "/rx_robot_2/imu" in browser.text, "received topic")
    elif view == "What if":
        browser.press("take the last minute")
        browser.see(lambda: is_planned(browser), "plan")


def test_nothing_is_asked_of_other_hosts(lab, open_browser):
    browser = open_browser(lab[0])
    for view in VIEWS:
        browser.tab(view)
        time.sleep(0.5)
    page = lab[0].partition("?")[0]
    asked = browser.asked(page)
    assert len(asked) > 20
    host = page.removeprefix("http:")
    for each in asked:
        assert each.startswith((f"http:{host}", f"ws:{host}", "data:", "blob:")), each


def test_a_policy_is_changed_by_mouse(lab, open_browser):
    browser, topic = open_browser(lab[0]), "/robot_1/odom"
    browser.tab("Topics")
    rows = browser.see(lambda: [r for r in browser.all("tbody tr") if topic in r.text], "row")
    rows[0].click()
    browser.see(lambda: "Policy, until the next restart" in browser.text, "policy")
    browser.see(lambda: "odom: class default" in browser.text, "its class")

    def policy():
        with ControlClient(lab[1] / "robot_1") as control:
            return control.ask("policy", {"topic": topic})

    before = policy()
    (slider,) = browser.all('[aria-label="Least time between messages"]')
    browser.run("arguments[0].scrollIntoView()", slider)
    box = slider.rect
    click_at(browser, box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"])
    wait_for(lambda: policy()["period_s"] != before["period_s"])
    assert policy()["period_s"] in (0.1, 0.2, 0.5)
    browser.see(lambda: "period_s 0" in browser.text, "what has changed")


def click_at(browser, x, y):
    """Click a place of the page as a mouse does."""
    top = browser.run("return [window.scrollX, window.scrollY]")
    for kind in ("mousePressed", "mouseReleased"):
        browser.driver.execute_cdp_cmd(
            "Input.dispatchMouseEvent",
            {"type": kind, "x": x - top[0], "y": y - top[1], "button": "left", "clickCount": 1},
        )


def test_it_can_be_paused_and_steered_by_keys(lab, open_browser):
    browser = open_browser(lab[0])
    browser.see(lambda: place(browser, 2), "robot 2")
    browser.press("pause")
    browser.see(lambda: "GO ON" in browser.text, "pause")
    time.sleep(0.5)
    still = place(browser, 2)
    time.sleep(1.0)
    assert place(browser, 2) == still
    browser.press("go on")
    browser.see(lambda: place(browser, 2) != still, "motion")
    browser.driver.find_element("tag name", "body").send_keys("3")
    browser.see(lambda: " bursts, " in browser.text, "the third tab")


def test_two_windows_show_their_own_station(lab, open_browser):
    first, second = open_browser(lab[0]), open_browser(lab[0], size=(800, 600))
    for browser in (first, second):
        browser.see(lambda browser=browser: browser.all(".sdr-stations"), "daemons")
    browser = second
    browser.all(".sdr-stations")[0].click()
    browser.see(
        lambda: [o for o in browser.all(".q-item") if o.text == "robot 2"], "choice"
    )[0].click()  # fmt: skip
    browser.tab("Topics")
    browser.see(lambda: "/rx_robot_1/odom" in browser.text, "what robot 2 receives")
    first.tab("Topics")
    first.see(lambda: "/rx_robot_2/odom" in first.text, "what robot 1 receives")
