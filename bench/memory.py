#!/usr/bin/env python3
"""Memory of `truedepth audit` and `truedepth correct` up to 5000 frames: peak resident set of the whole process.

    python3 bench/memory.py audit|correct RECORDING [FRAMES ...]      (100 1000 5000; needs 0.5 MB per frame and side)

Frames are those of the recording over and over, hard-linked under new timestamps. `audit` writes its report; `correct`
zooms depth and carries colour over as it is. Expects target/release/truedepth, or TRUEDEPTH.
"""
import json, os, shutil, subprocess, sys, tempfile, time
from pathlib import Path

PARENT = """
import os, sys
pid = os.posix_spawn(sys.argv[1], sys.argv[1:], os.environ)
_, status, usage = os.wait4(pid, 0)
print(usage.ru_maxrss)
sys.exit(status != 0)
"""

root = Path(__file__).resolve().parent.parent
binary = os.environ.get("TRUEDEPTH", root / "target/release/truedepth")
verb, source = sys.argv[1], Path(sys.argv[2])
counts = [int(n) for n in sys.argv[3:]] or [100, 1000, 5000]
names = sorted(int(p.stem.split("_")[1]) for p in source.glob("rgb_*.png"))
metadata = {f: json.loads((source / f).read_text()) for f in ("DepthMetadata.json", "CameraMetadata.json")}
# Beside the source, so that links need not cross file systems; else copies.
work = Path(tempfile.mkdtemp(prefix="memory-"))
try:
    for count in counts:
        recording = work / f"rec{count}"
        recording.mkdir()
        out = {f: [] for f in metadata}
        for i in range(count):
            old, new = names[i % len(names)], 1000 + 500 * i
            for kind in ("rgb", "depth"):
                one = recording / f"{kind}_{new}.png"
                first = work / f"first_{kind}_{old}.png"
                if not first.exists():
                    shutil.copy(source / f"{kind}_{old}.png", first)
                os.link(first, one)
            for f, rows in metadata.items():
                row = next(r for r in rows if r["Timestamp"] == old)
                out[f].append({**row, "Timestamp": new})
        for f, rows in out.items():
            (recording / f).write_text(json.dumps(rows))
        start = time.perf_counter()
        if verb == "correct":
            options = ["--fault", "depth-zoom=0.9507"]
        else:
            options = ["--board", "10x8:20.875mm:10.4375mm:ARUCO_ORIGINAL"]
        command = [binary, verb, recording, "-o", work / "out", *options, "-q", "--trust"]
        # A child starts with its parent's peak: the parent is a fresh interpreter, smaller than what is measured.
        small = [sys.executable, "-I", "-S", "-c", PARENT, *map(str, command)]
        peak = int(subprocess.run(small, check=verb == "correct", stdout=subprocess.PIPE, text=True).stdout.split()[-1])
        seconds = time.perf_counter() - start
        print(f"{count} frames: peak {peak / 1024:.1f} MB, {seconds:.2f} s", flush=True)
        shutil.rmtree(work / "out")
finally:
    shutil.rmtree(work)
