"""Names that come from the air or the network are text, whatever they contain."""

import msgspec
import pytest
import zenoh

from benchmarks.fleet.field import free_endpoint
from benchmarks.peers.zenoh_router import router_config
from sdrlinkd.fleet import Keys, Passed, encode
from sdrlinkd.reports import (
    LatencyReport,
    ReceivedTopicReport,
    VerdictReport,
)
from tests.programs import sdrlinkctl
from tests.reported import neighbor, snapshot, topic
from tests.web.conftest import page_of
from tests.web.odometry import ODOMETRY, odometry

pytestmark = pytest.mark.slow
SCRIPT = "<script>window.hurt=1</script>"
IMAGE = '<img src="/absent" onerror="window.hurt=2">'
KEYS = Keys("mine")


def hostile():
    """The report of a daemon that hears a robot with such names."""
    latency = LatencyReport(wait_ms=1, reassembly_ms=2, air_ms=3, handover_ms=4)
    received = ReceivedTopicReport(
        src=2, topic_id=3, name=f"/{IMAGE}", republished_as=f"/rx_robot_2/{SCRIPT}", delivered=5,
        dropped={f"rx_{IMAGE}": 3}, pdr=1.0, age_ms_p50=1.0, age_ms_p99=2.0, latency=latency,
    )  # fmt: skip
    found = snapshot(
        7, topics=[topic(1, f"/robot_7/{IMAGE}", SCRIPT, dropped={SCRIPT: 2})],
        neighbors=[neighbor(2, snr_db=9.0, per_lately=0.1)], received=[received],
        dropped={IMAGE: 4},
    )  # fmt: skip
    verdict = VerdictReport(level="DEGRADED", reasons=[f"{SCRIPT}{IMAGE}"])
    return msgspec.structs.replace(found, verdict=verdict)


@pytest.fixture
def fleet():
    """A Zenoh router at which a gateway answers with hostile names: (its endpoint, a clock)."""
    endpoint = free_endpoint()
    clock = {"uptime_s": 1.0}

    def answer(query):
        clock["uptime_s"] += 1.0
        told = msgspec.structs.replace(hostile(), uptime_s=clock["uptime_s"])
        query.reply(str(query.key_expr).replace("*", "7"), msgspec.json.encode(told))

    with zenoh.open(router_config(endpoint)) as router:
        router.declare_queryable(KEYS.gateway(7, "status"), answer)
        yield endpoint, router


@pytest.fixture
def page(fleet):
    endpoint, router = fleet
    arguments = ("web", "--fleet", "mine", "--connect", endpoint, "--listen", "127.0.0.1:0")
    with sdrlinkctl(*arguments) as process:
        yield page_of(process), router


def test_markup_in_names_is_shown_as_text(page, open_browser):
    url, router = page
    browser = open_browser(url)
    browser.see(lambda: SCRIPT in browser.text, "the verdict")
    key = KEYS.message(2, f"{IMAGE}/{SCRIPT}")
    attachment = encode(Passed(gw=7, ty=ODOMETRY))
    for x in range(20):
        router.put(key, odometry(float(x), 1.0), attachment=attachment)
    titles = (
        "return [...document.querySelectorAll('[data-robot=\"2\"] title')].map(e => e.textContent)"
    )
    browser.see(lambda: IMAGE in "".join(browser.run(titles)), "the topic of the position")
    browser.tab("Topics")
    browser.see(lambda: browser.text.count(SCRIPT) >= 3, "topics")
    assert IMAGE in browser.text
    browser.tab("Link")
    browser.see(lambda: len(browser.all(".sdr-chart canvas")) >= 8, "charts")
    hover_all(browser)
    assert browser.run("return window.hurt") is None
    assert not browser.all("img[src='/absent']")


def hover_all(browser):
    """Show the tooltips of all pictures, which libraries like to make of markup."""
    for chart in browser.all(".sdr-chart canvas"):
        browser.run("arguments[0].scrollIntoView()", chart)
        where = browser.run(
            "const b = arguments[0].getBoundingClientRect(); return [b.x, b.y, b.width, b.height]",
            chart,
        )
        for share in (0.3, 0.6, 0.9):
            place = {"x": where[0] + share * where[2], "y": where[1] + 0.5 * where[3]}
            browser.driver.execute_cdp_cmd(
                "Input.dispatchMouseEvent", {"type": "mouseMoved", **place}
            )


@pytest.mark.long
def test_what_cannot_be_asked_is_said(page, open_browser):
    browser = open_browser(page[0])
    browser.tab("Topics")
    rows = browser.see(lambda: browser.all("tbody tr"), "topics")
    rows[0].click()
    browser.see(lambda: "cannot be asked" in browser.text, "why not")
    browser.press("close")
    browser.tab("What if")
    browser.press("take the last minute")
    browser.see(lambda: "not within reach" in browser.text, "why not")
