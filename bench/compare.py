#!/usr/bin/env python3
"""truedepth beside OpenCV, in one run on one machine.

    python3 bench/compare.py [--runs N] [--data DIR] [--old PYTHON] [--new PYTHON]

1. The paper's whole job on the 50-frame iPhone recording: decode, detect, calibrate, compare depth with the board.
   `truedepth audit` (without its report, and with it) against `opencv_paper.py` with OpenCV 4.5.5. Whole processes.
2. Detection alone, per frame on one thread, on every calibration frame, against OpenCV 4.5.5 and the newest 4.x.

The runs of the rivals alternate, so that a busy moment of the machine hits all; the best of N counts.
Processor seconds are said beside wall seconds: on a busy machine they are the fairer number.
Without --old and --new the Pythons are made once, as virtual environments below target/bench.
Builds `truedepth` in release first.
"""

import argparse
import json
import os
import platform
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent
OLD = ["opencv-contrib-python==4.5.5.64", "numpy<2"]
NEW = ["opencv-contrib-python>=4.14,<5"]
BOARD = "10x8:20.875mm:10.4375mm:ARUCO_ORIGINAL"
CALIBRATION = "zeiss/FrontCamCalibrationDataset"
IPHONE = CALIBRATION + "/iPhone11Pro_iOS14"


def python_with(name, packages):
    """The interpreter of a virtual environment with these packages, made where it is missing."""
    folder = ROOT / "target" / "bench" / name
    python = folder / "bin" / "python"
    done = folder / "installed"
    if not done.exists():
        print(f"making {folder} with {' '.join(packages)}", file=sys.stderr)
        subprocess.run([sys.executable, "-m", "venv", "--clear", folder], check=True)
        subprocess.run([python, "-m", "pip", "install", "--quiet", *packages], check=True)
        done.touch()
    return str(python)


def run(command, allowed=(0,)):
    """Standard output, wall seconds and processor seconds of a whole process."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    start = time.perf_counter()
    process = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    wall_s = time.perf_counter() - start
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if process.returncode not in allowed:
        sys.exit(f"{command[:4]} ended with {process.returncode}:\n{process.stderr}")
    cpu_s = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return process.stdout, wall_s, cpu_s


def machine():
    model = platform.processor() or platform.machine()
    try:
        for line in Path("/proc/cpuinfo").read_text().splitlines():
            if line.startswith("model name"):
                model = line.split(":", 1)[1].strip()
                break
    except OSError:
        pass
    return f"{model}, {os.cpu_count()} cores, {platform.system()} {platform.release()}"


def whole_job(truedepth, old, recording, runs):
    job, paper, auto, reference = [], [], [], []
    with tempfile.TemporaryDirectory() as folder:
        report = ["-q", "-o", os.path.join(folder, "report"), recording]
        for _ in range(runs):
            job.append(run([truedepth, "audit", "--method", "paper", "--json", "-q", recording], (0, 3)))
            paper.append(run([truedepth, "audit", "--method", "paper", "--json", *report], (0, 3)))
            auto.append(run([truedepth, "audit", *report], (0, 3)))
            reference.append(run([old, str(HERE / "opencv_paper.py"), recording]))
    rival = best(reference)
    audit, result = json.loads(paper[0][0]), json.loads(reference[0][0])
    inside_s = min(json.loads(text)["seconds"] for text, _, _ in reference)

    def row(name, times):
        (wall_s, cpu_s), (rival_wall_s, rival_cpu_s) = times, rival
        print(
            f"  {name:<32} {wall_s:>7.3f} s   ratio {wall_s / rival_wall_s:.2f}"
            f"   processor {cpu_s:>6.3f} s   ratio {cpu_s / rival_cpu_s:.2f}"
        )

    def numbers(name, focal_px, depth):
        print(
            f"  {name:<32} focal length {focal_px:.2f} px, depth error "
            f"{depth['factory_median_error_mm']:+.2f} mm (factory), {depth['own_median_error_mm']:+.2f} mm (own)"
        )

    print(f"Whole job, {result['n_images']} frames (whole processes, best of {runs})")
    row(f"OpenCV {result['opencv']}, Python", rival)
    row("truedepth, paper's job, no page", best(job))
    row("truedepth audit --method paper", best(paper))
    row("truedepth audit", best(auto))
    print(f"  (OpenCV without starting Python and importing: {inside_s:.3f} s)")
    numbers(f"OpenCV {result['opencv']}, Python", result["focal_px"], result)
    errors = {f"{whose}_median_error_mm": 1e3 * audit["depth"][f"{whose}_median_error_m"]["value"] for whose in ("factory", "own")}
    numbers("truedepth audit --method paper", audit["calibration"]["focal_px"]["value"], errors)


def best(runs):
    """The least wall seconds and the least processor seconds."""
    return min(wall_s for _, wall_s, _ in runs), min(cpu_s for _, _, cpu_s in runs)


def detection(truedepth, old, new, images, runs):
    rivals = {}
    for _ in range(runs):
        options = ["--board", BOARD, "--json", "--timings", "--threads", "1", "-q"]
        text, _, _ = run([truedepth, "detect", *options, *images])
        found = json.loads(text)["images"]
        ms = sum(image["detect_ms"] for image in found) / len(found)
        n_corners = sum(len(image["corners"]) for image in found)
        keep(rivals, "truedepth detect", ms, n_corners)
        for python in [old, new]:
            text, _, _ = run([python, str(HERE / "opencv_detect.py"), *images])
            result = json.loads(text)
            keep(rivals, f"OpenCV {result['opencv']}", result["ms_per_image"], result["n_corners"])
    print(f"Detection, {len(images)} frames, one thread (mean per frame, best of {runs})")
    ours = rivals["truedepth detect"][0]
    for name, (ms, n_corners) in rivals.items():
        print(f"  {name:<38} {ms:>8.2f} ms   {n_corners} corners   ratio {ours / ms:.3f}")


def keep(rivals, name, ms, n_corners):
    best = rivals.get(name, (ms, n_corners))
    rivals[name] = min(best, (ms, n_corners))


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--runs", type=int, default=5, help="best of this many (default 5)")
    parser.add_argument("--data", default=os.environ.get("TRUEDEPTH_DATA", ROOT.parent / "shared/data"))
    parser.add_argument("--old", help="a Python with OpenCV 4.5.5")
    parser.add_argument("--new", help="a Python with the newest OpenCV 4.x")
    args = parser.parse_args()

    data = Path(args.data)
    if not (data / IPHONE).is_dir():
        sys.exit(f"{data / IPHONE} is absent; name the data folder with --data or TRUEDEPTH_DATA")
    old = args.old or python_with("opencv-4.5.5", OLD)
    new = args.new or python_with("opencv-4.x", NEW)
    build = ["cargo", "build", "--release", "--quiet", "-p", "truedepth-cli"]
    subprocess.run(build, cwd=ROOT, check=True)
    target = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
    truedepth = str(target / "release" / "truedepth")

    rustc = subprocess.run(["rustc", "--version"], capture_output=True, text=True).stdout.strip()
    print(f"{machine()}; {run([truedepth, '--version'])[0].strip()}; {rustc}")
    whole_job(truedepth, old, str(data / IPHONE), args.runs)
    images = sorted(str(path) for path in (data / CALIBRATION).glob("*/rgb_*.png"))
    detection(truedepth, old, new, images, args.runs)


if __name__ == "__main__":
    main()
