#!/usr/bin/env python3
"""The picture at the head of the README, docs/scale.svg: reprojection residuals that look perfect beside point clouds
that are too small.

    python3 tools/scale_picture.py RECORDING [TRUEDEPTH]

RECORDING is iPadPro12_5gen_iOS15 of ZEISS/iPad_TrueDepth_Issue_Eval, unpacked. For every frame: the RMS of the
reprojection residuals with the factory's and with the measured intrinsics, and the length of the board's outermost
corner rows in the point cloud, from sensor depth and those intrinsics, against the printed length. Needs Python alone.
"""
import json, math, statistics, struct, subprocess, sys, tempfile, zlib
from pathlib import Path

SQUARE_M, COLUMNS, ROWS = 0.020875, 9, 7  # the paper's board: inner corners of 10x8 squares
BOARD = "10x8:20.875mm:10.4375mm:ARUCO_ORIGINAL"


def depth_map(path):
    """A 16-bit grey PNG, not interlaced: columns and rows of metres."""
    data, at, packed = path.read_bytes(), 8, b""
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at : at + 8])
        body = data[at + 8 : at + 8 + length]
        if kind == b"IHDR":
            width, height, bits, colour = struct.unpack(">IIBB", body[:10])
            assert (bits, colour) == (16, 0), "a 16-bit grey PNG"
        packed += body if kind == b"IDAT" else b""
        at += 12 + length
    raw, stride = zlib.decompress(packed), 2 * width
    rows, before = [], bytearray(stride)
    for y in range(height):
        kind, line = raw[y * (stride + 1)], bytearray(raw[y * (stride + 1) + 1 : (y + 1) * (stride + 1)])
        for i in range(stride):
            a, b, c = line[i - 2] if i > 1 else 0, before[i], before[i - 2] if i > 1 else 0
            p = a + b - c
            paeth = a if abs(p - a) <= min(abs(p - b), abs(p - c)) else b if abs(p - b) <= abs(p - c) else c
            line[i] = (line[i] + (0, a, b, (a + b) // 2, paeth)[kind]) & 255
        rows.append([v / 1e4 for v in struct.unpack(f">{width}H", line)])
        before = line
    return rows


def span_error(corners, depth, k):
    """Length between the outermost corners of each row in the point cloud, as a share of the printed length, minus 1."""
    shares = []
    for row in range(ROWS):
        ends = []
        for column in (0, COLUMNS - 1):
            corner = corners.get(row * COLUMNS + column)
            z = depth[round(corner[1])][round(corner[0])] if corner else 0.0
            if z > 0.0:
                ends.append([(corner[0] - k["cx"]) / k["fx"] * z, (corner[1] - k["cy"]) / k["fy"] * z, z])
        if len(ends) == 2:
            shares.append(math.dist(*ends) / (SQUARE_M * (COLUMNS - 1)) - 1.0)
    return statistics.median(shares) if shares else None


def run(binary, *args):
    return json.loads(subprocess.run([binary, *args], stdout=subprocess.PIPE, text=True).stdout)


def strip(x0, width, title, unit, domain, groups):
    """A row of dots for each group over one axis."""
    lo, hi = domain
    at = lambda v: x0 + (v - lo) / (hi - lo) * width
    out = [f'<text x="{x0}" y="34" class="t">{title}</text>']
    n = 5 if lo < 0 else 4
    for tick in range(n + 1):
        v = lo + (hi - lo) * tick / n
        out.append(f'<path d="M{at(v):.1f} 56V168" class="g"/><text x="{at(v):.1f}" y="186" class="a">{v:+.0f}{unit}</text>'
                   if lo < 0 else
                   f'<path d="M{at(v):.1f} 56V168" class="g"/><text x="{at(v):.1f}" y="186" class="a">{v:.2f}{unit}</text>')
    for (name, colour, values, label), y in zip(groups, (84, 136)):
        for i, v in enumerate(values):
            out.append(f'<circle cx="{at(v):.1f}" cy="{y + (i * 7) % 15 - 7}" r="3.4" fill="{colour}" fill-opacity=".75"/>')
        out.append(f'<text x="{x0}" y="{y - 14}" class="n" fill="{colour}">{name}: <tspan class="b">{label}</tspan></text>')
    return out


recording = Path(sys.argv[1])
binary = sys.argv[2] if len(sys.argv) > 2 else str(Path(__file__).resolve().parent.parent / "target/release/truedepth")
with tempfile.TemporaryDirectory() as scratch:
    audit = run(binary, "audit", str(recording), "--json", "-q", "-o", f"{scratch}/report")
seen = run(binary, "detect", str(recording), "--json", "-q", "--board", BOARD)["images"]
calibration = run(binary, "calibrate", str(recording), "--json", "-q")
factory = calibration["factory_focal_px"]
fx, fy = calibration["focal_xy_px"]
cx, cy = calibration["principal_point_px"]
measured = {"fx": fx, "fy": fy, "cx": cx, "cy": cy}
said = dict(measured, fx=factory, fy=factory)
rms, spans = {"factory": [], "measured": []}, {"factory": [], "measured": []}
for image in seen:
    name = Path(image["path"]).name
    frame = next((f for f in audit["frames"] if f["color"] == name), None)
    if not (frame and frame["depth"] and frame["factory_rms_px"] and frame["own_rms_px"]):
        continue
    corners = {c["id"]: (c["x_px"], c["y_px"]) for c in image["corners"]}
    depth = depth_map(recording / frame["depth"])
    errors = [span_error(corners, depth, k) for k in (said, measured)]
    if None not in errors:
        for kind, error in zip(spans, errors):
            spans[kind].append(100 * error)
        rms["factory"].append(frame["factory_rms_px"])
        rms["measured"].append(frame["own_rms_px"])

middle = {kind: (statistics.median(rms[kind]), statistics.median(spans[kind])) for kind in rms}
names = {"factory": (f"factory, f = {said['fx']:.1f} px", "#d55e00"), "measured": (f"measured, f = {measured['fx']:.1f} px", "#0072b2")}
svg = ['<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 860 200" font-family="system-ui, sans-serif">',
       "<style>text{font-size:13px;fill:#333}.t{font-size:15px;font-weight:600}.a{font-size:11px;text-anchor:middle;fill:#666}"
       ".n{font-size:13px}.b{font-weight:700}.g{stroke:#ddd;fill:none}</style>",
       '<rect width="860" height="200" fill="#fff"/>']
svg += strip(30, 370, "Reprojection residuals, RMS per frame", " px", (0.0, 1.0),
             [(*names[k], rms[k], f"{middle[k][0]:.2f} px") for k in rms])
svg += strip(460, 370, "Length of the board in the point cloud", " %", (-8.0, 2.0),
             [(*names[k], spans[k], f"{middle[k][1]:+.1f} %") for k in spans])
svg.append("</svg>")
target = Path(__file__).resolve().parent.parent / "docs/scale.svg"
target.write_text("\n".join(svg) + "\n")
print(f"{target}: {len(rms['factory'])} frames, {middle}")
