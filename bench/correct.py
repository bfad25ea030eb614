#!/usr/bin/env python3
"""Correcting a recording beside the same steps in Python with OpenCV, one thread and two, in one run.

    python3 bench/correct.py RECORDING --python PYTHON_WITH_CV2      (a recording with lookup tables)

Steps of both: decode colour and depth, resample colour by a table (remap, bilinear) and depth by table and zoom (nearest in
OpenCV, which knows no holes; edge-aware in truedepth), encode both. Output sizes are said: compression is not alike.
OpenCV's `arithmetic` is remap and warpPerspective alone, `coding` imread and imwrite, of the same run; truedepth's are
from `cargo run --release --example correct_speed`, one thread, between two of OpenCV's runs.
Expects target/release/truedepth and target/release/examples/correct_speed, or TRUEDEPTH and CORRECT_SPEED.
"""
import argparse, json, os, shutil, subprocess, sys, tempfile, time
from pathlib import Path

RIVAL = r'''
import cv2, json, sys, time
import numpy as np
from ast import literal_eval
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
source, out, threads = Path(sys.argv[1]), Path(sys.argv[2]), int(sys.argv[3])
cv2.setNumThreads(1)
row = json.loads((source / "DepthMetadata.json").read_text())[0]
reference = literal_eval(row["IntrinsicMatrixReferenceDimensions"])
k0, k1 = (literal_eval(row[f"IntrinsicMatrix.{i}"]) for i in (0, 1))
center = np.array(literal_eval(row["LensDistortionCenter"])) * 640 / reference[0]
table = row["LensDistortionLookupTable"]
table = np.array(literal_eval(table) if isinstance(table, str) else table, dtype=float)
y, x = np.mgrid[0:480, 0:640].astype(float)
dx, dy = x - center[0], y - center[1]
r = np.hypot(dx, dy)
farthest = np.hypot(max(center[0], 640 - center[0]), max(center[1], 480 - center[1]))
m = 1 + np.interp(r / farthest * (len(table) - 1), np.arange(len(table)), table)
mx, my = (center[0] + m * dx).astype(np.float32), (center[1] + m * dy).astype(np.float32)
zoom, c = 0.9507, (k0[2], k1[2])
Z = np.array([[zoom, 0, (1 - zoom) * c[0]], [0, zoom, (1 - zoom) * c[1]], [0, 0, 1]])
def one(path):
    t = [time.perf_counter()]
    color = cv2.imread(str(path), cv2.IMREAD_COLOR)
    depth = cv2.imread(str(path).replace("rgb_", "depth_"), cv2.IMREAD_UNCHANGED)
    t.append(time.perf_counter())
    color = cv2.remap(color, mx, my, cv2.INTER_LINEAR)
    depth = cv2.warpPerspective(depth, Z, (640, 480), flags=cv2.INTER_NEAREST)
    depth = cv2.remap(depth, mx, my, cv2.INTER_NEAREST)
    t.append(time.perf_counter())
    cv2.imwrite(str(out / path.name), color)
    cv2.imwrite(str(out / path.name.replace("rgb_", "depth_")), depth)
    t.append(time.perf_counter())
    return t[2] - t[1], t[1] - t[0] + t[3] - t[2]
start = time.perf_counter()
with ThreadPoolExecutor(threads) as pool:
    times = list(pool.map(one, sorted(source.glob("rgb_*.png"))))
print(json.dumps({"arithmetic_s": sum(t[0] for t in times), "coding_s": sum(t[1] for t in times),
                  "frames_s": time.perf_counter() - start, "n": len(times)}))
'''

parser = argparse.ArgumentParser()
parser.add_argument("recording", type=Path)
parser.add_argument("--python", default=sys.executable)
parser.add_argument("--runs", type=int, default=3)
args = parser.parse_args()
root = Path(__file__).resolve().parent.parent
binary = os.environ.get("TRUEDEPTH", str(root / "target/release/truedepth"))
speed = os.environ.get("CORRECT_SPEED", str(root / "target/release/examples/correct_speed"))
work = Path(tempfile.mkdtemp(prefix="correct-"))


def megabytes(folder):
    return sum(p.stat().st_size for p in folder.glob("*.png")) / 1e6


try:
    for threads in (1, 2):
        best, split = {}, None
        for _ in range(args.runs):
            text = subprocess.run([speed, args.recording, "distorted", "depth-zoom=0.9507"], check=True,
                                  capture_output=True, text=True).stdout
            run = json.loads(text)
            split = run if split is None or run["resample_ms"] < split["resample_ms"] else split
            rival = work / "rival"
            rival.mkdir()
            start = time.perf_counter()
            text = subprocess.run([args.python, "-c", RIVAL, args.recording, rival, str(threads)],
                                  check=True, capture_output=True, text=True).stdout
            theirs = {**json.loads(text), "whole_s": time.perf_counter() - start, "mb": megabytes(rival)}
            shutil.rmtree(rival)
            start = time.perf_counter()
            subprocess.run([binary, "correct", args.recording, "-o", work / "out", "--fault", "distorted", "--fault",
                            "depth-zoom=0.9507", "-q", "--threads", str(threads)], check=True, capture_output=True)
            ours = {"whole_s": time.perf_counter() - start, "mb": megabytes(work / "out")}
            shutil.rmtree(work / "out")
            for name, run in (("opencv", theirs), ("truedepth", ours)):
                if name not in best or run["whole_s"] < best[name]["whole_s"]:
                    best[name] = run
        o, t = best["opencv"], best["truedepth"]
        # On two threads OpenCV's own arithmetic waits for the other's memory: compared is what one thread needs.
        arithmetic_s = o["arithmetic_s"] if threads == 1 else arithmetic_s
        n = o["n"]
        print(f"{threads} thread(s), {n} frames, best of {args.runs}:")
        print(f"  OpenCV     whole process {o['whole_s']:.3f} s, frames alone {o['frames_s']:.3f} s "
              f"(arithmetic {1e3 * o['arithmetic_s'] / n:.2f} ms, coding {1e3 * o['coding_s'] / n:.2f} ms a frame), "
              f"{o['mb']:.1f} MB written")
        print(f"  truedepth  whole process {t['whole_s']:.3f} s = {t['whole_s'] / n * 1e3:.2f} ms a frame, "
              f"{t['mb']:.1f} MB written; {o['frames_s'] / t['whole_s']:.2f} x OpenCV's frames alone")
        coding_ms = split["decode_ms"] + split["encode_ms"]
        print(f"             of one thread: arithmetic {split['resample_ms']:.2f} ms = "
              f"{1e3 * arithmetic_s / n / split['resample_ms']:.2f} x OpenCV's, coding {coding_ms:.2f} ms a frame = "
              f"{100 * coding_ms / (coding_ms + split['resample_ms']):.0f} %")
finally:
    shutil.rmtree(work)
