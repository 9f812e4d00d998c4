#!/usr/bin/env python3
"""Writes flyin.json and walk.json, paths of 30 s that end and begin at Chamonix."""
import json
import math
import os

LONGITUDE, LATITUDE = 6.8694, 45.9237
METRES_EAST = 77600.0  # a degree of longitude there
METRES_NORTH = 111160.0  # a degree of latitude
FOLDER = os.path.dirname(os.path.abspath(__file__))


def place(east, north):
    return [round(LONGITUDE + east / METRES_EAST, 7), round(LATITUDE + north / METRES_NORTH, 7)]


def write(name, keyframes):
    path = {"veduta_path": 1, "ease": False, "fov": 50}
    path["clearance"] = 1.0 if name == "walk" else 40.0
    with open(os.path.join(FOLDER, name + ".json"), "w") as file:
        lines = ",\n".join("  " + json.dumps(k) for k in keyframes)
        file.write(json.dumps(path)[:-1] + ',\n "keyframes": [\n' + lines + "\n]}\n")


def flyin():
    """Down the valley from the north-east, 8.9 km, 300 m/s, towards the middle."""
    keyframes = []
    for i in range(7):
        left = 8858.0 * (1 - i / 6)
        north = left * math.cos(math.radians(40)) * (1 + 0.03 * math.sin(i))
        keyframes.append({"at": place(left * math.sin(math.radians(40)), north),
                          "height": round(120 + 680 * (1 - i / 6), 1), "time": 5.0 * i,
                          "heading": 220, "pitch": -9})
    write("flyin", keyframes)


def walk():
    """On foot, 1.4 m/s, eyes 1.7 m above the ground; every 2 s another way, seeded."""
    state, east, north, heading = 2004, 0.0, -250.0, 0.0
    keyframes = []
    for i in range(16):
        keyframes.append({"at": place(east, north), "height": 1.7, "time": 2.0 * i,
                          "heading": round(heading, 1), "pitch": 2})
        state = (state * 1103515245 + 12345) % 2**31
        heading = (heading + (state / 2**31 - 0.5) * 70) % 360
        east += 2.8 * math.sin(math.radians(heading))
        north += 2.8 * math.cos(math.radians(heading))
    write("walk", keyframes)


flyin()
walk()
