#!/usr/bin/env python3
"""Writes src/board/dictionaries/*.hex from OpenCV's predefined ArUco dictionaries.

  pip install opencv-contrib-python && tools/dictionaries.py src/board/dictionaries

One marker a line: its bits row by row from the top left, first bit highest, white = 1, in hexadecimal.
The first line is a comment with size, count, maxCorrectionBits and the OpenCV version. 50/100/250 of a family are
prefixes of its 1000, which this script asserts, so only the largest is written.
"""
import sys
import cv2
import numpy as np

A = cv2.aruco
FAMILIES = {
    "4x4": ["DICT_4X4_50", "DICT_4X4_100", "DICT_4X4_250", "DICT_4X4_1000"],
    "5x5": ["DICT_5X5_50", "DICT_5X5_100", "DICT_5X5_250", "DICT_5X5_1000"],
    "6x6": ["DICT_6X6_50", "DICT_6X6_100", "DICT_6X6_250", "DICT_6X6_1000"],
    "7x7": ["DICT_7X7_50", "DICT_7X7_100", "DICT_7X7_250", "DICT_7X7_1000"],
    "aruco_original": ["DICT_ARUCO_ORIGINAL"],
    "apriltag_16h5": ["DICT_APRILTAG_16h5"],
    "apriltag_25h9": ["DICT_APRILTAG_25h9"],
    "apriltag_36h10": ["DICT_APRILTAG_36h10"],
    "apriltag_36h11": ["DICT_APRILTAG_36h11"],
    "aruco_mip_36h12": ["DICT_ARUCO_MIP_36h12"],
}


def codes(name):
    d = A.getPredefinedDictionary(getattr(A, name))
    n = d.markerSize
    out = []
    for i in range(len(d.bytesList)):
        bits = A.Dictionary.getBitsFromByteList(d.bytesList[i : i + 1], n).ravel()
        out.append(int("".join(str(int(b)) for b in bits), 2))
    return n, d.maxCorrectionBits, out


for family, names in FAMILIES.items():
    n, correct, largest = codes(names[-1])
    for name in names:
        m, c, some = codes(name)
        assert m == n and largest[: len(some)] == some, name
        print(f"{name:24s} {n}x{n} {len(some):5d} markers, corrects {c}")
    with open(f"{sys.argv[1]}/{family}.hex", "w") as f:
        f.write(f"# {names[-1]} {n}x{n} {len(largest)} markers, OpenCV {cv2.__version__}\n")
        f.writelines(f"{c:x}\n" for c in largest)
