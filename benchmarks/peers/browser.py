"""A real browser, without a screen."""

import contextlib
import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from selenium import webdriver
from selenium.common.exceptions import StaleElementReferenceException, WebDriverException
from selenium.webdriver.chrome.service import Service
from selenium.webdriver.common.by import By
from selenium.webdriver.remote.webelement import WebElement

FLAGS = (
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
    "--disable-background-networking", "--disable-component-update", "--disable-sync",
    "--disable-dev-shm-usage",
)  # fmt: skip
T = TypeVar("T")
PATIENCE_S = 60.0


class Browser:
    """Chromium with one window of `size`."""

    def __init__(self, folder: Path, size: tuple[int, int] = (1280, 800)) -> None:
        options = webdriver.ChromeOptions()
        for flag in (*FLAGS, f"--window-size={size[0]},{size[1]}", f"--user-data-dir={folder}"):
            options.add_argument(flag)
        options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
        options.binary_location = "/usr/bin/chromium"
        self.driver = webdriver.Chrome(options, Service("/usr/bin/chromedriver"))

    def open(self, url: str) -> None:
        """Open a page."""
        self.driver.get(url)

    def all(self, selector: str) -> list[WebElement]:
        """The elements that a CSS selector selects."""
        return self.driver.find_elements(By.CSS_SELECTOR, selector)

    def see(self, condition: Callable[[], T], what: str = "it") -> T:
        """Wait until `condition()` is true, and return what it gives."""
        deadline = time.monotonic() + PATIENCE_S
        while True:
            with contextlib.suppress(StaleElementReferenceException, IndexError):
                if found := condition():
                    return found
            if time.monotonic() > deadline:
                raise AssertionError(f"waited in vain for {what}: {self.text[:2000]}")
            time.sleep(0.1)

    @property
    def text(self) -> str:
        """The text that is seen."""
        return self.driver.find_element(By.TAG_NAME, "body").text

    def tab(self, name: str) -> None:
        """Choose a tab, and wait until it is shown."""

        def chosen() -> bool:
            (tab,) = (each for each in self.all(".q-tab") if each.text.lower() == name.lower())
            if tab.get_attribute("aria-selected") != "true":
                tab.click()
                return False
            return True

        self.see(chosen, f"tab {name}")

    def press(self, text: str) -> None:
        """Press the button with this text."""

        def pressed() -> bool:
            (button,) = (each for each in self.all("button") if each.text.lower() == text)
            button.click()
            return True

        self.see(pressed, f"button {text}")

    def run(self, script: str, *arguments: object) -> Any:  # noqa: ANN401
        """What a script returns in the page."""
        return self.driver.execute_script(script, *arguments)

    def picture(self, path: Path | None = None) -> bytes:
        """The window as PNG, also as a file."""
        found = self.driver.get_screenshot_as_png()
        if path is not None:
            path.write_bytes(found)
        return found

    def complaints(self) -> list[str]:
        """What the page wrote on the console that is worse than a remark."""
        logged = self.driver.get_log("browser")  # type: ignore[no-untyped-call]
        return [
            each["message"] for each in logged
            if each["level"] in ("SEVERE", "WARNING")
        ]  # fmt: skip

    def asked(self, page: str) -> list[str]:
        """The addresses of everything that a page asked for."""
        found = []
        for each in self.driver.get_log("performance"):  # type: ignore[no-untyped-call]
            event = json.loads(each["message"])["message"]
            told = event["params"]
            is_its_own = told.get("documentURL", "").startswith(page)
            if event["method"] == "Network.requestWillBeSent" and is_its_own:
                found.append(told["request"]["url"])
            elif event["method"] == "Network.webSocketCreated":
                found.append(told["url"])
        return found

    def close(self) -> None:
        """Close the browser; closing twice is fine."""
        with contextlib.suppress(WebDriverException):
            self.driver.quit()
