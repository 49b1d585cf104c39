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


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    chromium = os.environ.get("CHROMIUM") or shutil.which("chromium") or shutil.which("google-chrome")
    if not chromium:
        pytest.skip("no Chromium found; install it or set CHROMIUM to its path")
    playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    with playwright.sync_playwright() as p:
        browser = p.chromium.launch(executable_path=chromium, args=ARGS)
        yield browser
        browser.close()


def _sample(name: str) -> tuple[dict[str, Any], samples.Columns, *tuple[Closeups, ...]]:
    module = evidence_samples if hasattr(evidence_samples, name) else samples
    return getattr(module, name)()  # type: ignore[no-any-return]


@pytest.fixture(scope="module")
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


class Watch:
    """Opens pages offline and keeps what no page may do: errors, console messages, requests, breaches of the policy."""

    def __init__(self, browser: Any, pages: Callable[[str], Path]) -> None:
        self.browser, self.pages = browser, pages
        self.contexts: list[Any] = []
        self.wrong: list[str] = []

    def open(
        self, name: str, address: str = "", *, width: int = 1280, theme: str = "light", script: bool = True
    ) -> Any:
        context = self.browser.new_context(
            viewport={"width": width, "height": 900}, color_scheme=theme, java_script_enabled=script, offline=True
        )
        self.contexts.append(context)
        page = context.new_page()
        page.add_init_script(WATCH)
        page.on("pageerror", lambda e: self.wrong.append(f"error {e}"))
        page.on("console", lambda m: self.wrong.append(f"console {m.type} {m.text}"))
        url = self.pages(name).as_uri()
        own = (url, "blob:")
        page.on("request", lambda r: None if r.url.startswith(own) else self.wrong.append(r.url))
        page.goto(url + address)
        if script:
            page.locator("html[data-ready]").wait_for(state="attached")
        return page

    def check(self) -> None:
        for context in self.contexts:
            for page in context.pages:
                self.wrong += page.evaluate("window.breaches || []")
        assert self.wrong == []

    def close(self) -> None:
        for context in self.contexts:
            context.close()


@pytest.fixture(scope="module")
def new_watch(browser: Any, pages: Callable[[str], Path]) -> Callable[[], Watch]:
    return lambda: Watch(browser, pages)


@pytest.fixture
def open_page(new_watch: Callable[[], Watch]) -> Iterator[Callable[..., Any]]:
    watch = new_watch()
    yield watch.open
    watch.check()
    watch.close()
