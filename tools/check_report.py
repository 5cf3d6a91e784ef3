#!/usr/bin/env python3
"""Opens a report.html in a browser without a network, checks that it works, and takes pictures.

    python3 tools/check_report.py out/run/report.html [more.html ...] [--pictures FOLDER] [--require]

Checks: only the file itself is loaded, the console is empty, every view of every plot shows curves
(and would not without values), x, y and z have one colour each, texts are large enough on a phone,
pictures of the arm are transparent, links have targets, dragging zooms, other time plots follow, a
double click resets, the cursor is shared, the page prints.
Needs playwright (pip install playwright) and a Chromium on the PATH or in CHROMIUM; without them it
prints "skipped" and exits with 0, or with 1 under --require. Exit code 1 if a check fails.
"""

import argparse
import os
import re
import shutil
import sys
import tempfile
from pathlib import Path

BROWSERS = ["chromium", "chromium-browser", "google-chrome", "google-chrome-stable"]
WIDTHS = [390, 1000, 1280, 1600]
# Counts pixels within the axes in the colour of a curve; grid, axes and texts have other colours,
# and marks are excluded.
INK = """async id => {
  const drawn = () => new Promise(done => setTimeout(done, 0));
  window.flexarmBare(true);
  await drawn();
  const { chart } = window.flexarmPlots().find(p => p.id === id);
  const canvas = chart.ctx.canvas, { left, top, width, height } = chart.bbox;
  const number = color => {
    const one = Object.assign(document.createElement("canvas"), { width: 1, height: 1 }).getContext("2d");
    one.fillStyle = color;
    one.fillRect(0, 0, 1, 1);
    return [...one.getImageData(0, 0, 1, 1).data];
  };
  const colors = chart.series.slice(1).map((s, k) => number(s.stroke(chart, k + 1)));
  const data = canvas.getContext("2d").getImageData(left, top, width, height).data;
  let count = 0;
  for (let k = 0; k < data.length; k += 4) {
    if (data[k + 3] < 100) continue;
    if (colors.some(c => Math.abs(c[0] - data[k]) + Math.abs(c[1] - data[k + 1]) + Math.abs(c[2] - data[k + 2]) < 24)) count++;
  }
  window.flexarmBare(false);
  await drawn();
  return count;
}"""
# Minimum number of pixels of a visible curve.
FEWEST = 40
DEAD = """() => [...document.querySelectorAll("a[href^='#']")].map(a => a.getAttribute("href"))
  .filter(href => href.length < 2 || !document.getElementById(href.slice(1)))"""
RANGES = """() => window.flexarmPlots().map(p => [p.id, p.time, p.chart.scales.x.min, p.chart.scales.x.max])"""


def ranges(page):
    return {name: (time, low, high) for name, time, low, high in page.evaluate(RANGES)}


def differs(a, b, scale):
    return abs(a - b) > 1e-6 * scale


class Checks:
    def __init__(self, name):
        self.name, self.failed = name, 0

    def that(self, good, text):
        print(f"{'ok    ' if good else 'FAILED'} {text}")
        self.failed += not good
        return good


# Size (CSS pixels) of the smallest text outside plots.
SMALLEST = """() => Math.min(...[...document.querySelectorAll("p, figcaption, td, th, dd, dt, li, summary, .triad text")]
  .filter(e => e.getClientRects().length && !e.closest(".u-legend")).map(e => parseFloat(getComputedStyle(e).fontSize)))"""
# Colour of each curve of an axis; and the variables of the page.
AXES = """() => {
  const style = getComputedStyle(document.documentElement);
  const wanted = Object.fromEntries(["x", "y", "z"].map(k => [k, style.getPropertyValue("--" + k).trim()]));
  const found = [];
  for (const { id, chart } of window.flexarmPlots())
    chart.series.forEach((s, k) => { if (wanted[s.label]) found.push([id, s.label, s.stroke(chart, k), wanted[s.label]]); });
  return found;
}"""
# Opacity in a corner of each picture of the arm.
CORNERS = """async () => {
  const found = [];
  for (const image of document.querySelectorAll(".arm img")) {
    const canvas = Object.assign(document.createElement("canvas"), { width: 1, height: 1 }).getContext("2d");
    canvas.drawImage(image, 0, 0);
    found.push(canvas.getImageData(0, 0, 1, 1).data[3]);
  }
  return found;
}"""
LEAST_SIZE = 12


def open_page(context, path, checks):
    requests, said = [], []
    page = context.new_page()
    page.on("request", lambda r: requests.append(r.url))
    page.on("console", lambda m: said.append(f"{m.type}: {m.text}"))
    page.on("pageerror", lambda e: said.append(f"error: {e}"))
    page.goto(path.resolve().as_uri())
    page.wait_for_function("window.flexarmPlots && window.flexarmPlots().every(p => p.chart)")
    page.wait_for_timeout(300)
    return page, requests, said


def check_zoom(page, checks):
    before = ranges(page)
    over_time = [name for name, (time, *_) in before.items() if time]
    first = over_time[0]
    over = page.locator(f"#plot-{first} .u-over")
    over.scroll_into_view_if_needed()
    box = over.bounding_box()
    y = box["y"] + 0.5 * box["height"]
    page.mouse.move(box["x"] + 0.3 * box["width"], y)
    page.mouse.down()
    page.mouse.move(box["x"] + 0.6 * box["width"], y, steps=8)
    page.mouse.up()
    page.wait_for_timeout(250)
    after = ranges(page)
    _, low, high = before[first]
    span = high - low
    _, a, b = after[first]
    near = abs(a - low - 0.3 * span) < 0.02 * span and abs(b - low - 0.6 * span) < 0.02 * span
    checks.that(near, f"dragging over {first} zooms from {low:.3f}..{high:.3f} to {a:.3f}..{b:.3f} s")
    follow = [n for n in over_time if after[n][1:] == after[first][1:]]
    checks.that(len(follow) == len(over_time), f"{len(follow)} of {len(over_time)} time plots have the same zoom")
    stay = [n for n in before if not before[n][0]]
    checks.that(all(after[n] == before[n] for n in stay), f"plots over other axes stay: {', '.join(stay) or 'none'}")
    page.mouse.dblclick(box["x"] + 0.5 * box["width"], y)
    page.wait_for_timeout(250)
    reset = ranges(page)
    same = all(not differs(reset[n][1], before[n][1], span) and not differs(reset[n][2], before[n][2], span) for n in over_time)
    checks.that(same, "a double click shows everything again")


def check_cursor(page, checks):
    over_time = [name for name, (time, *_) in ranges(page).items() if time]
    over = page.locator(f"#plot-{over_time[0]} .u-over")
    box = over.bounding_box()
    page.mouse.move(box["x"] + 0.4 * box["width"], box["y"] + 0.5 * box["height"])
    page.wait_for_timeout(150)
    legends = "() => window.flexarmPlots().filter(p => p.time).map(p => p.chart.root.querySelector('.u-legend .u-value').textContent)"
    times = page.evaluate(legends)
    values = [float(m.group()) for m in (re.search(r"[-+0-9.eE]+", t) for t in times) if m]
    span = max(ranges(page)[over_time[0]][1:])
    together = len(values) == len(over_time) and max(values) - min(values) < 0.02 * span
    checks.that(together, f"the cursor is at the same time in {len(values)} of {len(over_time)} time plots")


def ink_of_views(page):
    """Counts pixels of curves in every view of every plot."""
    ink = {}
    for name in ranges(page):
        select = page.locator(f"#plot-{name} select")
        names = select.locator("option").all_text_contents() if select.count() else [""]
        for value, view in enumerate(names):
            if select.count():
                select.select_option(str(value))
                page.wait_for_timeout(30)
            ink[f"{name} {view}".strip()] = page.evaluate(INK, name)
        if select.count():
            select.select_option("0")
    page.wait_for_timeout(100)
    return ink


def check_views(page, checks):
    ink = ink_of_views(page)
    empty = [name for name, count in ink.items() if count < FEWEST]
    fewest = min(ink.values(), default=0)
    checks.that(ink and not empty, f"curves are seen in {len(ink)} views, at least {fewest} pixels {', '.join(empty)}")


def check_empty(context, path, checks):
    """Checks that the same page without values does not pass, so that the check is able to fail."""
    def nothing(found):
        return '"y":[' + ",".join(["null"] * (found.group().count(",") + 1)) + "]"

    text = re.sub(r'"y":\[[^\]]*\]', nothing, path.read_text("utf-8"))
    with tempfile.TemporaryDirectory() as folder:
        empty = Path(folder) / "empty.html"
        empty.write_text(text, "utf-8")
        page, *_ = open_page(context, empty, checks)
        ink = ink_of_views(page)
        page.close()
    checks.that(all(count < FEWEST for count in ink.values()), f"without values no curve is seen, {max(ink.values())} pixels at most")


def check(browser, path, folder, checks):
    context = browser.new_context(viewport={"width": 1440, "height": 900}, offline=True)
    page, requests, said = open_page(context, path, checks)
    own = [path.resolve().as_uri()]
    others = [url for url in requests if url not in own and not url.startswith("data:")]
    checks.that(not others, f"nothing is loaded but the file: {len(requests)} request(s) {' '.join(others)}")
    ids = list(ranges(page))
    wanted = {"torques", "energy"}
    checks.that(wanted <= set(ids) and len(ids) >= 3, f"{len(ids)} plots: {', '.join(ids)}")
    dead = page.evaluate(DEAD)
    checks.that(not dead, f"all links lead somewhere {' '.join(dead)}")
    pictures = page.evaluate("() => [...document.images].map(i => [i.complete && i.naturalWidth, i.clientWidth])")
    checks.that(all(natural >= shown > 0 for natural, shown in pictures), f"{len(pictures)} pictures, sharp: {pictures}")
    axes = page.evaluate(AXES)
    wrong = [a for a in axes if a[2] != a[3]]
    checks.that(not wrong, f"x, y and z have their colours in {len(axes)} curves {wrong or ''}")
    corners = page.evaluate(CORNERS)
    checks.that(not any(corners), f"pictures have no ground of their own: {corners}")
    check_zoom(page, checks)
    check_cursor(page, checks)
    check_views(page, checks)
    check_empty(context, path, checks)
    wide = page.evaluate("() => document.documentElement.scrollWidth - window.innerWidth")
    checks.that(wide <= 0, "nothing is wider than the window")
    checks.that(not said, f"nothing is said on the console {said or ''}")
    if folder:
        page.mouse.move(0, 0)
        page.evaluate("() => window.scrollTo(0, 0)")
        page.screenshot(path=folder / "top.png")
        page.screenshot(path=folder / "full.png", full_page=True)
    pdf = page.pdf(format="A4", print_background=True, prefer_css_page_size=True)
    pages = len(re.findall(rb"/Type\s*/Page[^s]", pdf))
    checks.that(pdf.startswith(b"%PDF") and pages > 0, f"prints to {pages} pages, {len(pdf) / 1e3:.0f} kB")
    if folder:
        (folder / "print.pdf").write_bytes(pdf)
    context.close()
    for width in WIDTHS:
        context = browser.new_context(viewport={"width": width, "height": 900}, offline=True)
        page, _, said = open_page(context, path, checks)
        extra = page.evaluate("() => document.documentElement.scrollWidth - window.innerWidth")
        checks.that(extra <= 0 and not said, f"fits into {width} pixels")
        size = page.evaluate(SMALLEST)
        checks.that(size >= LEAST_SIZE, f"its smallest text has {size:g} pixels")
        if folder:
            page.screenshot(path=folder / f"width_{width}.png", full_page=True)
        context.close()
    context = browser.new_context(viewport={"width": 1440, "height": 900}, offline=True, color_scheme="dark")
    page, _, said = open_page(context, path, checks)
    back = page.evaluate("() => getComputedStyle(document.body).backgroundColor")
    light = sum(int(x) for x in re.findall(r"\d+", back)[:3]) / 3
    checks.that(light < 80 and not said, f"dark where the reader wants it dark: {back}")
    if folder:
        page.screenshot(path=folder / "dark.png", full_page=True)
    context.close()


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("reports", nargs="+", type=Path)
    parser.add_argument("--pictures", type=Path, help="folder for pictures of the page")
    parser.add_argument("--require", action="store_true", help="fail if there is no browser")
    arguments = parser.parse_args()

    def skip(why):
        print(f"skipped: {why}")
        return 1 if arguments.require else 0

    try:
        from playwright.sync_api import Error, sync_playwright
    except ImportError:
        return skip("python has no playwright")
    browser_path = os.environ.get("CHROMIUM") or next(filter(None, map(shutil.which, BROWSERS)), None)
    if not browser_path:
        return skip("there is no Chromium")
    for path in arguments.reports:
        if not path.is_file():
            print(f"{path}: there is no such file")
            return 2
    failed = 0
    with sync_playwright() as playwright:
        try:
            browser = playwright.chromium.launch(executable_path=browser_path, args=["--no-sandbox"])
        except Error as error:
            return skip(f"{browser_path} does not start: {str(error).splitlines()[0]}")
        for k, path in enumerate(arguments.reports):
            print(f"{path}, {path.stat().st_size / 1e6:.2f} MB")
            folder = arguments.pictures
            if folder:
                folder = folder / str(k) if len(arguments.reports) > 1 else folder
                folder.mkdir(parents=True, exist_ok=True)
            checks = Checks(path)
            check(browser, path, folder, checks)
            failed += checks.failed
        browser.close()
    print(f"{failed} checks failed" if failed else "all checks passed")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
