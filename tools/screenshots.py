#!/usr/bin/env python3
"""Makes the pictures of docs/images from the program, or says which are out of date.

    pip install "rerun-sdk>=0.36.3" playwright pillow     (in a virtual environment; a Chromium on PATH for the pages)
    tools/screenshots.py [--flexarm target/release/flexarm] [--only recording,map,...] [--out docs/images]
    tools/screenshots.py --check        pictures that are older than their sources, by the commits

Each picture is a flexarm command and the output file to show. No display is needed: the Rerun
viewer runs headless (it needs a Vulkan driver; in software: Debian's mesa-vulkan-drivers and
libvulkan1). Missing programs are reported and skipped; the exit status is 1 only if a possible
picture failed. Made elsewhere: catalogue.svg by tools/catalogue.py, web.webp from the desktop.png
that `PICTURES=FOLDER tools/build_web.py --test` writes; logo.svg and formulation.svg by hand.
"""

import argparse
import os
import pathlib
import re
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent
# Picture: arguments of flexarm, file in its output folder, seconds of playback before the shot.
RERUN = {
    "arm": (["compare"], "run.rrd", 1.0),
    "recording": (["compare"], "run.rrd", 6.5),
    "study": (
        ["compare", "robots/kr210/links.toml", "--with", "links=modal,name=modal links", "--with", "robot=robots/kr210/beams.toml,name=tubes"],
        "study.rrd",
        6.5,
    ),
}
# Picture: arguments of flexarm, page in its output folder, headings at the top and below the end of the picture.
PAGES = {
    "report": (["compare"], "report.html", None, None),
    "map": (["map", "kr210", "--box", "0.9:2.5,-1:1,0.2:1.8", "--grid", "0.1", "--keep-out", "0.9", "--wrench", "500,0,0", "--workpiece", "0.8,0.6,0.4"], "map.html", "Slices through the best place", "compliance worst"),
    "sweep": (["sweep", "payload_speed.toml"], "report.html", "Main effects", "Pareto front"),
}
# Picture: arguments of flexarm, pictures in its output folder, one above the other; width.
OUTPUTS = {
    "lobes.svg": (["lobes", "kr210", "--at", "0,-60deg,90deg,0,60deg,0", "--tool", "endmill_20mm"], ["lobes.svg"], None),
    "reduce.png": (["reduce", "robots/test/lower_arm/lower_arm.reduce.toml"], ["interfaces.png", "unit_loads.png"], 1000),
    "stress.webp": (["compare", "kr210_stress", "pick_and_place"], ["stress.png"], 1100),
}
# What the pictures show: a newer commit there makes a picture old.
SOURCES = {
    "arm": ["crates/faces/flexarm-rerun/src"],
    "recording": ["crates/faces/flexarm-rerun/src"],
    "study": ["crates/faces/flexarm-rerun/src"],
    "report": ["crates/run/flexarm-run/src/report"],
    "map": ["crates/studies/flexarm-map/src"],
    "python_plot": ["crates/faces/flexarm-python/python/flexarm/_plot.py"],
    "lobes": ["crates/studies/flexarm-chatter/src"],
    "sweep": ["crates/studies/flexarm-sweep/src"],
    "reduce": ["crates/run/flexarm-linkmaker/src"],
    "stress": ["crates/results/flexarm-draw/src"],
    "web": ["web/src"],
}
# The moving picture of the README, and the part of the window that it shows.
ANIMATED = "arm"
CROP = (0.0, 0.037, 1.0, 0.61)


def free_port():
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        return s.getsockname()[1]


def viewer_pictures(file, out, seconds, frames=1, every=0.0):
    """Saves what the Rerun viewer shows `seconds` after it was opened, then `every` seconds more.

    Returns the files `out`/0.png, ... and the time between the first and the last (s).
    """
    from rerun.experimental import ViewerClient

    port = free_port()
    viewer = shutil.which("rerun", path=f"{pathlib.Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}")
    command = [viewer, "--headless", "--bind", "127.0.0.1", "--port", str(port), "--window-size", "1600x1000", str(file)]
    # A process group of its own: the wrapper of the Python package does not pass signals on.
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True)
    files = [out / f"{k}.png" for k in range(frames)]
    try:
        client, deadline = None, time.monotonic() + 60
        while client is None:
            try:
                client = ViewerClient.connect(f"rerun+http://127.0.0.1:{port}/proxy")
            except Exception:
                if time.monotonic() > deadline or process.poll() is not None:
                    raise
                time.sleep(0.3)
        time.sleep(seconds)
        begin = time.monotonic()
        for k, shot in enumerate(files):
            time.sleep(max(0.0, begin + k * every - time.monotonic()))
            client.save_screenshot(str(shot))
        took = time.monotonic() - begin
        # The viewer writes when it has drawn.
        size, deadline = -1, time.monotonic() + 30
        while time.monotonic() < deadline:
            time.sleep(0.5)
            now = sum(shot.stat().st_size for shot in files if shot.exists())
            if now > 0 and now == size:
                break
            size = now
    finally:
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
    return [shot for shot in files if shot.exists()], took


def animation(file, out, scratch, seconds):
    """The views of the arm and of the TCP error over a run of ten seconds, as a moving picture."""
    from PIL import Image

    shots, took = viewer_pictures(file, scratch, seconds, frames=36, every=0.28)
    pictures = [Image.open(shot).convert("RGB") for shot in shots]
    # Without the panels at the sides, the top and the bottom of the window.
    wide, high = pictures[0].size
    box = tuple(round(x) for x in (CROP[0] * wide, CROP[1] * high, CROP[2] * wide, CROP[3] * high))
    pictures = [picture.crop(box).resize((900, round(900 * (box[3] - box[1]) / (box[2] - box[0])))) for picture in pictures]
    duration = round(1e3 * took / max(1, len(pictures) - 1))
    pictures[0].save(out, save_all=True, append_images=pictures[1:], duration=duration, loop=0, quality=60, method=6)


def page_picture(page, begin, end, out):
    """Saves the top of a page, or what is between two headings."""
    from playwright.sync_api import sync_playwright

    browser = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
    with sync_playwright() as playwright:
        view = playwright.chromium.launch(executable_path=browser, args=["--no-sandbox"]).new_page(viewport={"width": 1100, "height": 1000})
        view.goto(page.resolve().as_uri())
        view.wait_for_timeout(1000)
        top = lambda heading: view.get_by_role("heading", name=heading).bounding_box()["y"]
        first = top(begin) if begin else 0
        high = top(end) - first if end else 1000
        view.screenshot(path=out, full_page=True, clip={"x": 0, "y": first, "width": 1100, "height": high})


def stacked(files, width, out):
    """Saves pictures one above the other; a vector picture as it is."""
    if out.suffix == ".svg":
        shutil.copyfile(files[0], out)
        return
    from PIL import Image

    pictures = [Image.open(file).convert("RGB") for file in files]
    pictures = [picture.resize((width, round(picture.height * width / picture.width))) for picture in pictures]
    whole = Image.new("RGB", (width, sum(picture.height for picture in pictures)))
    for k, picture in enumerate(pictures):
        whole.paste(picture, (0, sum(above.height for above in pictures[:k])))
    whole.save(out, **({"quality": 80, "method": 6} if out.suffix == ".webp" else {}))
    if out.suffix == ".png":
        smaller(out)


def prepare(flexarm, scratch):
    """Files of the runs: the study of docs/sweep.md, the KR 210 class arm with the stress of its castings."""
    study = (ROOT / "docs/sweep.md").read_text()
    (scratch / "payload_speed.toml").write_text(re.search(r"```toml\n(# payload_speed.toml\n.*?)```", study, re.S)[1])
    robot = scratch / "kr210_stress"
    shutil.copytree(ROOT / "robots/kr210", robot)
    for link in ("link_2", "link_3"):
        reduce = [flexarm, "reduce", robot / f"fe/{link}.reduce.toml", "--stress", "--flex", robot / f"fe/{link}.flex", "--force", "-o", scratch / link, "--quiet"]
        subprocess.run(reduce, check=True, stdout=subprocess.DEVNULL)


def old_pictures(folder):
    """Pictures whose sources have a newer commit."""
    stamp = lambda *paths: int(subprocess.run(["git", "log", "-1", "--format=%ct", "--", *paths], cwd=ROOT, capture_output=True, text=True).stdout or 0)
    pictures = {picture.stem: picture for picture in sorted(folder.iterdir())}
    return [name for name, paths in SOURCES.items() if name not in pictures or stamp(str(pictures[name])) < stamp(*paths)]


def smaller(picture):
    """Reduces to 256 colours, which suffice for a screen, at a quarter of the size."""
    try:
        from PIL import Image
    except ImportError:
        return
    # Curves have few pixels: a median cut would merge their colours.
    image = Image.open(picture).convert("RGB")
    image.quantize(256, method=Image.Quantize.MAXCOVERAGE, kmeans=2, dither=Image.Dither.NONE).save(picture, optimize=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--flexarm", default=str(ROOT / "target/release/flexarm"))
    parser.add_argument("--only", default="", help="names, with commas between them")
    parser.add_argument("--out", type=pathlib.Path, default=ROOT / "docs/images")
    parser.add_argument("--check", action="store_true", help="list pictures that are older than their sources")
    arguments = parser.parse_args()
    if arguments.check:
        old = old_pictures(arguments.out)
        print(f"older than their sources: {', '.join(old)}" if old else "no picture is older than its sources")
        return 1 if old else 0
    only = set(filter(None, arguments.only.split(",")))
    names = [*RERUN, *PAGES, *(file.partition(".")[0] for file in OUTPUTS), "python_plot"]
    unknown = only - set(names)
    if unknown:
        parser.error(f"no picture is called {', '.join(sorted(unknown))}; there are {', '.join(names)}")
    if not pathlib.Path(arguments.flexarm).is_file():
        parser.error(f"{arguments.flexarm} is not there: cargo build --release --features rerun, or --flexarm")
    arguments.out.mkdir(parents=True, exist_ok=True)
    wanted = lambda name: not only or name in only
    failed = False

    with tempfile.TemporaryDirectory() as scratch:
        runs = {}

        def run(command):
            key = tuple(command)
            if key not in runs:
                folder = pathlib.Path(scratch) / str(len(runs))
                made = [str(pathlib.Path(scratch) / word) if (pathlib.Path(scratch) / word).exists() else word for word in command]
                subprocess.run([arguments.flexarm, *made, "-o", str(folder), "--quiet"], check=True, cwd=ROOT, stdout=subprocess.DEVNULL)
                runs[key] = folder
            return runs[key]

        try:
            import rerun.experimental  # noqa: F401

            with_rerun = True
        except ImportError:
            with_rerun = False
            print("skipped: recordings (pip install rerun-sdk)")
        for name, (command, file, seconds) in RERUN.items():
            if not (wanted(name) and with_rerun):
                continue
            out = arguments.out / f"{name}.{'webp' if name == ANIMATED else 'png'}"
            try:
                shots = pathlib.Path(scratch) / f"shots_{name}"
                shots.mkdir()
                if name == ANIMATED:
                    animation(run(command) / file, out, shots, seconds)
                else:
                    from PIL import Image

                    # Without the bar at the top, which has remarks on the machine.
                    window = Image.open(viewer_pictures(run(command) / file, shots, seconds)[0][0])
                    window.crop((0, round(CROP[1] * window.height), *window.size)).save(out)
                    smaller(out)
                print(f"{out}: {out.stat().st_size} bytes")
            except Exception as error:
                print(f"{name}: no picture: {error}", file=sys.stderr)
                failed = True
        if wanted("sweep") or wanted("stress"):
            prepare(arguments.flexarm, pathlib.Path(scratch))
        for name, (command, file, begin, end) in PAGES.items():
            if wanted(name):
                try:
                    out = arguments.out / f"{name}.png"
                    page_picture(run(command) / file, begin, end, out)
                    smaller(out)
                    print(f"{out}: {out.stat().st_size} bytes")
                except ImportError:
                    print(f"skipped: {name} (pip install playwright)")
        for file, (command, files, width) in OUTPUTS.items():
            out = arguments.out / file
            if wanted(out.stem):
                try:
                    stacked([run(command) / part for part in files], width, out)
                    print(f"{out}: {out.stat().st_size} bytes")
                except ImportError:
                    print(f"skipped: {out.stem} (pip install pillow)")
        if wanted("python_plot"):
            try:
                import flexarm
                import matplotlib.figure

                figure = matplotlib.figure.Figure(figsize=(7.5, 3.2), layout="constrained")
                flexarm.load("kr210").flexible().simulate().plot(figure.subplots())
                figure.savefig(arguments.out / "python_plot.png", dpi=120)
            except ImportError:
                print("skipped: python_plot (install the wheel and matplotlib)")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
