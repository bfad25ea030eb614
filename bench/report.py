#!/usr/bin/env python3
"""What the report costs: `truedepth audit` with it and without, on the 50-frame iPhone recording.

    python3 bench/report.py [--runs N] [--data DIR] [--truedepth PATH] [--most RATIO]

Without a report is `audit --json` (the same audit, the same JSON, no pictures and no page). Whole processes; both
alternate, so that a busy moment of the machine hits both, and the best of N counts.
Builds `truedepth` in release first, unless --truedepth names a binary.
Ends with 1 where the ratio of wall times is above --most, or the page larger than 5 MB.
"""

import argparse
import os
import subprocess
import sys
import tempfile
from pathlib import Path

from compare import IPHONE, ROOT, best, machine, run

MOST_BYTES = 5_000_000


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--runs", type=int, default=7)
    parser.add_argument("--data", default=os.environ.get("TRUEDEPTH_DATA", ROOT.parent / "shared" / "data"), type=Path)
    parser.add_argument("--truedepth", type=Path)
    parser.add_argument("--most", type=float, default=1.5)
    options = parser.parse_args()
    recording = options.data / IPHONE
    if not recording.is_dir():
        sys.exit(f"{recording} is not there: name the folder of the recordings with --data")
    truedepth = options.truedepth
    if truedepth is None:
        subprocess.run(["cargo", "build", "--release", "--quiet"], cwd=ROOT, check=True)
        truedepth = ROOT / "target" / "release" / "truedepth"

    without, with_report = [], []
    with tempfile.TemporaryDirectory() as folder:
        report = Path(folder) / "report"
        command = [str(truedepth), "audit", "-q", "--json", str(recording)]
        for _ in range(options.runs):
            without.append(run(command, (0, 3)))
            with_report.append(run([*command, "-o", str(report)], (0, 3)))
        n_bytes = (report / "report.html").stat().st_size

    (wall_s, cpu_s), (report_wall_s, report_cpu_s) = best(without), best(with_report)
    ratio = report_wall_s / wall_s
    print(machine())
    print(f"audit of {recording.name}, whole processes, best of {options.runs}")
    print(f"  without report  {wall_s:6.3f} s   processor {cpu_s:6.3f} s")
    print(f"  with report     {report_wall_s:6.3f} s   processor {report_cpu_s:6.3f} s")
    print(f"  ratio           {ratio:6.2f}     processor {report_cpu_s / cpu_s:6.2f}     at most {options.most}")
    print(f"  report.html     {n_bytes / 1e6:6.2f} MB")
    return 1 if ratio > options.most or n_bytes > MOST_BYTES else 0


if __name__ == "__main__":
    sys.exit(main())
