"""Draws calibrate-boards.svg and calibrate-projection.svg from what `truedepth calibrate REC --json` printed.

    python figures.py A.json B.json C.json       # the standard library is enough; boards of 9 by 7 corners
"""

import json
import sys
from pathlib import Path

HERE = Path(__file__).parent
COLUMNS, ROWS = 9, 7


def colour(share):
    """From blue (−1) over white to orange (+1)."""
    share = max(-1.0, min(1.0, share))
    end = (201, 92, 20) if share > 0 else (32, 96, 168)
    return "#%02x%02x%02x" % tuple(round(250 + abs(share) * (e - 250)) for e in end)


def svg(name, width, height, parts):
    head = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" font-family="sans-serif">'
    (HERE / name).write_text("\n".join([head, f'<rect width="{width}" height="{height}" fill="white"/>', *parts, "</svg>\n"]))


def text(x, y, words, size=11, anchor="start"):
    return f'<text x="{x}" y="{y}" font-size="{size}" text-anchor="{anchor}" fill="#222">{words}</text>'


def boards(calibrations):
    cell, parts, top = 26, [], 40
    for i, calibration in enumerate(calibrations):
        left, surface = 12 + i * (COLUMNS * cell + 24), calibration["board_surface"]
        size, sigma = (1e3 * surface["peak_to_valley_m"][of] for of in ("value", "sigma"))
        parts.append(text(left, 16, calibration["recording"], 12))
        parts.append(text(left, 31, f"{size:.3f} ± {sigma:.3f} mm from crest to trough"))
        for id, height in enumerate(1e3 * z for z in surface["heights_m"]):
            x, y = left + id % COLUMNS * cell, top + id // COLUMNS * cell
            parts.append(f'<rect x="{x}" y="{y}" width="{cell}" height="{cell}" fill="{colour(height / 0.5)}"/>')
            parts.append(text(x + cell / 2, y + cell / 2 + 3, f"{1000 * height:+.0f}".replace("-", "−"), 8, "middle"))
    width = 12 + len(calibrations) * (COLUMNS * cell + 24)
    parts.append(text(12, top + ROWS * cell + 18, "Height of each corner in µm, into the board; the best plane is taken out."))
    svg("calibrate-boards.svg", width, top + ROWS * cell + 28, parts)


def projections(calibrations):
    cell, parts, top = 15, [], 40
    width = 12
    for calibration in calibrations:
        grid = calibration["projection_uncertainty"]
        columns, rows, left = grid["columns"], grid["rows"], width
        worst = max(s for s in grid["sigma_px"] if s is not None)
        parts.append(text(left, 16, calibration["recording"], 12))
        words = f'{calibration["model"]}, at {grid["depth_m"]:.2f} m; worst {worst:.2f} px'
        parts.append(text(left, 31, words))
        for i, sigma in enumerate(grid["sigma_px"]):
            x, y = left + i % columns * cell, top + i // columns * cell
            fill = "#888" if sigma is None else colour(sigma / 2)
            parts.append(f'<rect x="{x}" y="{y}" width="{cell}" height="{cell}" fill="{fill}"/>')
            if sigma is not None and i % 4 == 0 and i // columns % 2 == 0:
                parts.append(text(x + cell / 2, y + cell / 2 + 3, f"{sigma:.1f}", 8, "middle"))
        width += columns * cell + 24
    parts.append(text(12, top + rows * cell + 18, "One σ of where a point is drawn, pixels, in its worst direction; full colour is 2 px."))
    svg("calibrate-projection.svg", width, top + rows * cell + 28, parts)


found = [json.load(open(path)) for path in sys.argv[1:]]
boards(found)
projections(found)
