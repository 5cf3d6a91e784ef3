#!/usr/bin/env python3
"""Takes the pictures of docs/images that show recordings and reports in their viewers.

    pip install "rerun-sdk>=0.36.3" playwright pillow     (in a virtual environment; a Chromium on PATH for the reports)
    tools/screenshots.py [--flexarm target/release/flexarm] [--only recording,mcap,...] [--out docs/images]

Each picture is a flexarm command and the output file to show. No display is needed: the Rerun
viewer runs headless (it needs a Vulkan driver; in software: Debian's mesa-vulkan-drivers and
libvulkan1). Missing programs are reported and skipped; the exit status is 1 only if a possible
picture failed.
"""

import argparse
import os
import pathlib
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
    "arm": (["compare", "kr210"], "run.rrd", 1.0),
    "recording": (["compare", "kr210"], "run.rrd", 6.5),
    "mcap": (["compare", "kr210"], "run.mcap", 6.5),
    "study": (
        ["compare", "robots/kr210/links.toml", "--with", "links=modal,name=modal links", "--with", "robot=robots/kr210/beams.toml,name=tubes"],
        "study.rrd",
        6.5,
    ),
}
# The moving picture of the README, and the part of the window that it shows.
ANIMATED = "arm"
CROP = (0.0, 0.03, 1.0, 0.498)
REPORTS = {
    "report": ["compare", "kr210"],
    "report_study": RERUN["study"][0],
}


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
    arguments = parser.parse_args()
    only = set(filter(None, arguments.only.split(",")))
    unknown = only - set(RERUN) - set(REPORTS)
    if unknown:
        parser.error(f"no picture is called {', '.join(sorted(unknown))}; there are {', '.join([*RERUN, *REPORTS])}")
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
                subprocess.run(
                    [arguments.flexarm, *command, "-o", str(folder), "--quiet"], check=True, cwd=ROOT, stdout=subprocess.DEVNULL
                )
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
                    shutil.copyfile(viewer_pictures(run(command) / file, shots, seconds)[0][0], out)
                    smaller(out)
                print(f"{out}: {out.stat().st_size} bytes")
            except Exception as error:
                print(f"{name}: no picture: {error}", file=sys.stderr)
                failed = True
        for name, command in REPORTS.items():
            if not wanted(name):
                continue
            folder = pathlib.Path(scratch) / f"pictures_{name}"
            check = [sys.executable, str(ROOT / "tools/check_report.py"), str(run(command) / "report.html"), "--pictures", str(folder)]
            done = subprocess.run(check, capture_output=True, text=True)
            print(done.stdout.strip().splitlines()[-1] if done.stdout.strip() else done.stderr.strip())
            if done.returncode != 0:
                failed = True
            elif (folder / "top.png").is_file():
                out = arguments.out / f"{name}.png"
                shutil.copyfile(folder / "top.png", out)
                smaller(out)
                print(f"{out}: {out.stat().st_size} bytes")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
