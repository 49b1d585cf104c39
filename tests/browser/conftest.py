"""A browser that opens report pages offline and keeps what no page may do."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from diagnosis.report.page import build_page
from diagnosis.results.result import Closeups
from tests import report_samples as samples
from tests.browser import evidence_samples

ARGS = ["--no-sandbox", "--disable-gpu", "--disable-background-networking", "--no-first-run"]
WATCH = (
    "window.breaches = [];"
    "document.addEventListener('securitypolicyviolation', e => breaches.push(e.violatedDirective + ' ' + e.blockedURI))"
)

#: Commands that are looked for: the one without windows is smaller and takes a little less CPU time for the same pages.
_CHROMIUM = ("chromium-headless-shell", "chromium", "google-chrome")
_PATIENCE_MS = 20_000  # a busy machine draws slowly; what is there at once is not waited for


@pytest.fixture(scope="package")
def browser() -> Iterator[Any]:
    chromium = os.environ.get("CHROMIUM") or next(filter(None, map(shutil.which, _CHROMIUM)), None)
    if not chromium:
        pytest.skip("no Chromium found; install it or set CHROMIUM to its path")
    playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    playwright.expect.set_options(timeout=_PATIENCE_MS)
    with playwright.sync_playwright() as p:
        browser = p.chromium.launch(executable_path=chromium, args=ARGS)
        yield browser
        browser.close()


def _sample(name: str) -> tuple[dict[str, Any], samples.Columns, *tuple[Closeups, ...]]:
    module = evidence_samples if hasattr(evidence_samples, name) else samples
    return getattr(module, name)()  # type: ignore[no-any-return]


@pytest.fixture(scope="package")
def pages(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    folder = tmp_path_factory.mktemp("pages")

    def written(name: str) -> Path:
        path = folder / f"{name} # 1.html"
        if not path.exists():
            report, columns, *near = _sample(name)
            page = build_page(report, columns, closeups=near[0] if near else None)
            path.write_text(page, encoding="utf-8", newline="\n")
        return path

    return written


class Tabs:
    """Tabs that tests may use again: a tab has compiled a page's scripts, most of what opening it costs."""

    def __init__(self, browser: Any) -> None:
        self.browser = browser
        self.free: dict[tuple[int, str], list[Any]] = {}

    def take(self, width: int, theme: str, script: bool) -> Any:
        """A blank tab as if no test had used it."""
        size = {"width": width, "height": 900}
        kept = self.free.get((width, theme), [])
        if not script or not kept:
            context = self.browser.new_context(
                viewport=size, color_scheme=theme, java_script_enabled=script, offline=True
            )
            page = context.new_page()
            page.add_init_script(WATCH)
            return page
        page = kept.pop()
        page.set_viewport_size(size)
        page.emulate_media(media="null", color_scheme=theme, reduced_motion="null")
        return page

    def give_back(self, page: Any, width: int, theme: str, script: bool) -> None:
        """Keep a tab for another test, unless more than it was opened or its page cannot have cleared its traces."""
        if not script or len(page.context.pages) > 1:
            page.context.close()
            return
        page.evaluate("localStorage.clear(), sessionStorage.clear()")
        page.goto("about:blank")
        page.mouse.move(0, 0)
        self.free.setdefault((width, theme), []).append(page)


class Watch:
    """Opens pages offline and keeps what no page may do: errors, console messages, requests, breaches of the policy."""

    def __init__(self, tabs: Tabs, pages: Callable[[str], Path]) -> None:
        self.tabs, self.pages = tabs, pages
        self.open_tabs: list[tuple[Any, tuple[int, str, bool], dict[str, Callable[[Any], None]]]] = []
        self.wrong: list[str] = []

    def open(
        self, name: str, address: str = "", *, width: int = 1280, theme: str = "light", script: bool = True
    ) -> Any:
        page = self.tabs.take(width, theme, script)
        url = self.pages(name).as_uri()
        own = (url, "blob:")
        heard: dict[str, Callable[[Any], None]] = {
            "pageerror": lambda e: self.wrong.append(f"error {e}"),
            "console": lambda m: self.wrong.append(f"console {m.type} {m.text}"),
            "request": lambda r: None if r.url.startswith(own) else self.wrong.append(r.url),
        }
        for event, listener in heard.items():
            page.on(event, listener)
        self.open_tabs.append((page, (width, theme, script), heard))
        page.goto(url + address)
        if script:
            page.locator("html[data-ready]").wait_for(state="attached")
        return page

    def check(self) -> None:
        for tab, *_ in self.open_tabs:
            for page in tab.context.pages:
                self.wrong += page.evaluate("window.breaches || []")
        assert self.wrong == []

    def close(self) -> None:
        for page, kind, heard in self.open_tabs:
            for event, listener in heard.items():
                page.remove_listener(event, listener)
            self.tabs.give_back(page, *kind)


@pytest.fixture(scope="package")
def tabs(browser: Any) -> Tabs:
    return Tabs(browser)


@pytest.fixture(scope="module")
def new_watch(tabs: Tabs, pages: Callable[[str], Path]) -> Callable[[], Watch]:
    return lambda: Watch(tabs, pages)


@pytest.fixture
def open_page(new_watch: Callable[[], Watch]) -> Iterator[Callable[..., Any]]:
    watch = new_watch()
    yield watch.open
    watch.check()
    watch.close()
