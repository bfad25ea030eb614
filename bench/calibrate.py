"""Least squares beside OpenCV's calibrateCamera: the same corners, models and start; seconds of one run on one machine.

    python bench/calibrate.py [VIEWS]        # in an environment with opencv-python and numpy; 50 views by default

OpenCV stops at its default termination (30 iterations or a relative change of 2e-16), truedepth at its own (parameters
good to 1e-7 of their σ); truedepth's time contains the poses to start from, the covariance and the leave-one-out check.
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


def main():
    n_views = sys.argv[1] if len(sys.argv) > 1 else "50"
    script = ROOT / "tests/golden/opencv/calibrate.py"
    made = subprocess.run([sys.executable, script, n_views], check=True, capture_output=True, text=True).stdout
    theirs = json.loads(made)
    with tempfile.NamedTemporaryFile("w", suffix=".json") as file:
        file.write(made)
        file.flush()
        command = ["cargo", "run", "--release", "--quiet", "--example", "calibrate_speed", "--", file.name]
        ours = json.loads(subprocess.run(command, check=True, capture_output=True, text=True, cwd=ROOT).stdout)
    print(f"{n_views} views, {theirs['made_by']}")
    print(f"{'model':<14} {'OpenCV ms':>10} {'truedepth ms':>13} {'ratio':>7} {'Δf rel.':>9} {'ΔRMS px':>9}")
    for model, seconds in theirs["seconds"].items():
        own, other = ours[model], theirs["models"][model]
        focal, rms = own["fx"] / other["fx"] - 1, own["rms_px"] - other["rms_px"]
        times = f"{1e3 * seconds:>10.2f} {1e3 * own['seconds']:>13.2f} {own['seconds'] / seconds:>7.3f}"
        print(f"{model:<14} {times} {focal:>9.1e} {rms:>9.1e}")


main()
