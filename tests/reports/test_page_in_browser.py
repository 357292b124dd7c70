"""The page in a real browser: what is clicked, typed and seen; skipped, saying so, where there is none."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from attrs import evolve
from tools import need

from matbench.measures.volumes import StoredVolume
from matbench.reports import page, tables
from matbench.reports.content import Report
from matbench.reports.numbers import Numbers
from matbench.space import DisparitySpace, Volume, surface

webdriver = pytest.importorskip("selenium.webdriver", reason="selenium is not installed: pip install -e '.[test]'")

from selenium.webdriver.chrome.service import Service  # noqa: E402
from selenium.webdriver.common.by import By  # noqa: E402
from selenium.webdriver.common.keys import Keys  # noqa: E402
from selenium.webdriver.support.ui import Select, WebDriverWait  # noqa: E402

PATIENCE = 60  # s: others use the machine, too
GOOD, BROKEN = "good", "broken[x=[1] \"'&]"


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    """One headless browser for all tests."""
    binary, driver = need("browser")
    options = webdriver.ChromeOptions()
    options.binary_location = binary
    for argument in ("--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--window-size=1366,900"):
        options.add_argument(argument)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    started = webdriver.Chrome(options, Service(driver))
    yield started
    started.quit()


def _volume(report: Report) -> Any:
    def volume(algorithm: str, _params: str, name: str, _seed: int) -> StoredVolume | None:
        scene = report.scenes[name]
        space = DisparitySpace.covering(scene.disparities, scene.n, scene.height, scene.width)
        truth = np.nan_to_num(scene.truth[1], nan=2.0)
        made: Volume = surface(space, {1: truth}, (0, 1, 2))
        return StoredVolume.of(made) if algorithm == GOOD else None

    return volume


@pytest.fixture
def shown(browser: Any, report: Report, tmp_path: Path) -> Any:
    """The made-up run's page, opened and drawn."""
    page.write_page(tmp_path / "report.html", evolve(report, volumes=_volume(report)))
    browser.get_log("browser")
    browser.get_log("performance")
    browser.set_window_size(1366, 900)
    browser.get((tmp_path / "report.html").as_uri())
    wait(browser, "return 'drawn' in document.documentElement.dataset && document.querySelector('#slice-method').value")
    return browser


def wait(browser: Any, script: str) -> None:
    WebDriverWait(browser, PATIENCE).until(lambda it: it.execute_script(script))


def column(browser: Any, table: str, number: int) -> list[str]:
    """The texts of a column, without what is said for readers of the screen only."""
    return list(
        browser.execute_script(
            "return [...document.querySelector(arguments[0]).tBodies[0].rows].filter(r => !r.hidden)"
            ".map(r => r.cells[arguments[1]].firstChild.textContent)",
            table,
            number,
        )
    )


def choose(browser: Any, select: str, value: str) -> None:
    Select(browser.find_element(By.ID, select)).select_by_value(value)


def pixel(browser: Any, canvas: str, x: int, y: int) -> list[int]:
    script = (
        "return [...document.querySelector(arguments[0]).getContext('2d')"
        ".getImageData(arguments[1], arguments[2], 1, 1).data].slice(0, 3)"
    )
    return list(browser.execute_script(script, canvas, x, y))


def test_tables_follow_what_is_chosen_and_sort_by_mouse_and_keyboard(shown: Any, report: Report) -> None:
    scores = [b for b in shown.find_elements(By.CSS_SELECTOR, "#best-table thead button") if "total_bad" in b.text]
    assert [b.text.splitlines()[0] for b in scores] == ["total_bad_1 %"]
    assert column(shown, "#best-table", 2) == ["10.51", "20.51", "30.01"]
    scores[0].click()
    assert column(shown, "#best-table", 2) == ["20.51", "10.51", "30.01"], "who is not ranked stays below"
    scores[0].send_keys(Keys.ENTER)
    assert column(shown, "#best-table", 2) == ["10.51", "20.51", "30.01"]
    assert shown.execute_script("return document.querySelector('#best-table [aria-sort]').ariaSort") == "ascending"

    choose(shown, "region", "mine")
    choose(shown, "score", "avg")
    rows = tables.labelled(report.results)
    for number, metric in ((2, "total_bad_1"), (3, "bad_1"), (4, "avg")):
        cells = rows[(rows["region"] == "mine") & (rows["metric"] == metric) & (rows["method"] == GOOD)]
        assert column(shown, "#best-table", number)[0] == tables.text(cells["value"].mean(), "px"), metric
    by_scene = tables.per_scene(report.results, "mine", "avg")
    assert column(shown, "#scenes-table", 1) == [tables.text(v, "px") for v in by_scene[GOOD]]
    assert column(shown, "#regions-table", 6)[0] == tables.text(by_scene[GOOD].mean(), "px")
    assert shown.find_element(By.ID, "scenes-caption").text == "avg in mine, px"
    # the script's lines are the template's
    labelled = evolve(report, results=rows, cells=tables.labelled(report.cells))
    order = tuple(tables.summary(report.results, report.cells).index)
    numbers = Numbers(labelled, evolve(tables.shared(report.results, report.cells), methods=order))
    wanted = numbers.against("avg", "mine")
    assert column(shown, "#real-table", 1) == [row["mean"] for row in wanted] == ["+10.00"]
    assert column(shown, "#real-table", 6) == ["too few scenes"]
    choose(shown, "reference", str(order[1]))
    assert column(shown, "#real-table", 0) == [GOOD]
    assert column(shown, "#real-table", 1) == ["-10.00"]

    shown.find_element(By.ID, "filter").send_keys("ONE")
    assert column(shown, "#scenes-table", 0) == ["made/"], "the name goes on after a place to break"
    assert len([s for s in shown.find_elements(By.CSS_SELECTOR, "section[data-scene]") if s.is_displayed()]) == 1
    assert "1 of 2 shown" in shown.find_element(By.ID, "filtered").text


def test_maps_are_drawn_slid_and_subtracted_by_keyboard(shown: Any, report: Report) -> None:
    opener = shown.find_element(By.CSS_SELECTOR, '[data-scene="0"] [data-kind="disparity"][data-map="0"]')
    shown.execute_script("arguments[0].focus()", opener)
    opener.send_keys(Keys.ENTER)
    wait(shown, "return document.querySelector('#large-caption').textContent.startsWith('left')")
    box = shown.find_element(By.ID, "large-picture").size
    assert box["width"] / box["height"] == pytest.approx(24 / 16, abs=0.02), "not distorted"
    truth = pixel(shown, "#large-picture", 23, 8)
    unknown = pixel(shown, "#large-picture", 23, 0)
    assert unknown == [128, 128, 128], "right is the truth, unknown in its first rows"
    slider = shown.switch_to.active_element
    assert slider.get_attribute("id") == "wipe"
    slider.send_keys(Keys.END)
    assert slider.get_attribute("value") == "100"
    method = pixel(shown, "#large-picture", 23, 8)
    assert pixel(shown, "#large-picture", 23, 0)[0] in (196, 250), "no answer"
    assert truth == [253, 231, 37] == method, "the last colour of viridis"
    assert pixel(shown, "#large-picture", 0, 8) != [68, 1, 84], "a quarter more than the truth, which is the first"
    slider.send_keys(Keys.HOME)
    assert pixel(shown, "#large-picture", 2, 8) != method

    hostile = report.cells["algorithm"].iloc[2]
    choose(shown, "large-right", "1")
    wait(shown, f"return document.querySelector('#large-caption').textContent.includes({hostile!r})")
    stripes = {tuple(pixel(shown, "#large-picture", x, 8)) for x in range(1, 24)}
    assert stripes == {(196, 196, 196), (250, 250, 250)}, "a map without answers"
    choose(shown, "large-right", "2")
    choose(shown, "large-kind", "difference")
    wait(shown, "return document.querySelector('#large-caption').textContent.includes('minus broken')")
    assert len({tuple(pixel(shown, "#large-picture", x, 8)) for x in range(24)}) == 1, "they agree everywhere"
    assert not slider.is_enabled()
    choose(shown, "large-right", "truth")
    wait(shown, "return document.querySelector('#large-caption').textContent.includes('minus truth')")
    assert pixel(shown, "#large-picture", 12, 8) != [247, 247, 246], "half a pixel of the pair nearer than the truth"
    choose(shown, "large-kind", "error")
    slider.send_keys(Keys.END)
    assert pixel(shown, "#large-picture", 12, 8) == pixel(shown, "#large-picture", 3, 8)
    slider.send_keys(Keys.ESCAPE)
    assert not shown.find_element(By.ID, "large").is_displayed()
    assert shown.switch_to.active_element == opener


def test_slices_show_volumes_where_they_were_kept(shown: Any) -> None:
    assert shown.find_element(By.ID, "slice-volume").is_displayed()
    assert [o.text for o in Select(shown.find_element(By.ID, "slice-row")).options] == ["8", "4", "12"]
    wait(shown, "return document.querySelector('#slice-visibility').naturalWidth")
    choose(shown, "slice-method", "2")
    wait(shown, "return document.querySelector('#slice-volume').hidden")
    assert "kept no volume" in shown.find_element(By.ID, "slice-none").text


def test_nothing_is_asked_of_the_network_nothing_fails_and_nothing_overflows(shown: Any) -> None:
    assert shown.get_log("browser") == []
    told = [json.loads(entry["message"])["message"] for entry in shown.get_log("performance")]
    asked = [one["params"]["request"]["url"] for one in told if one["method"] == "Network.requestWillBeSent"]
    assert any(url.startswith("file:") for url in asked), "the log is not empty"
    assert [url for url in asked if not url.startswith(("file:", "data:"))] == []
    assert shown.execute_script("return window.alerted === undefined")
    assert shown.execute_script("return document.title") == "a run <script>alert(1)</script> · matbench"
    shown.execute_cdp_cmd(
        "Emulation.setDeviceMetricsOverride", {"width": 390, "height": 844, "deviceScaleFactor": 2, "mobile": True}
    )
    try:
        assert shown.execute_script("return document.documentElement.scrollWidth") == 390
        button = shown.find_element(By.CSS_SELECTOR, '[data-scene="0"] [data-kind="error"]')
        shown.execute_script("arguments[0].click()", button)
        wait(shown, "return document.querySelector('#large-caption').textContent.startsWith('left')")
        assert shown.execute_script("return document.querySelector('#large').scrollWidth") <= 390
        width = shown.execute_script("return document.querySelector('#large').getBoundingClientRect().width")
        assert width <= 390
    finally:
        shown.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})
