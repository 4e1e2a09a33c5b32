#!/usr/bin/env python3
"""Writes the layouts of the recipes in configs/, GDSII with a database unit of 1 nm.

    python3 configs/layouts/make.py [FOLDER]
"""

import struct
import sys
from pathlib import Path

# Of each layout, by layer: rectangles (x0, y0, x1, y1) in nm.
LAYOUTS = {
    # Trenches at a pitch of 80 nm, every second one on the other layer. One ends within the domain.
    "litho_etch_litho_etch": {
        1: [(-140, -300, -100, 300), (20, -300, 60, 300)],
        2: [(-60, -300, -20, 300), (100, -300, 140, 20)],
    },
    # Mandrels at a pitch of 160 nm (1), and what is cut from the spacers around them (2).
    "sadp_cut": {
        1: [(-100, -300, -60, 300), (60, -300, 100, 300)],
        2: [(-80, 20, 0, 100)],
    },
    # A via (1) under one end of a trench (2).
    "dual_damascene": {
        1: [(-110, -40, -30, 40)],
        2: [(-130, -60, 130, 60)],
    },
}


def record(kind, data=b""):
    return struct.pack(">HH", len(data) + 4, kind) + data


def text(value):
    raw = value.encode()
    return raw + b"\0" * (len(raw) % 2)


def real(value):
    """An excess-64 floating-point number."""
    exponent = 64
    while value >= 1:
        value, exponent = value / 16, exponent + 1
    while value < 1 / 16:
        value, exponent = value * 16, exponent - 1
    return bytes([exponent]) + round(value * 2**56).to_bytes(7, "big")


def boundary(layer, box):
    x0, y0, x1, y1 = box
    corners = [x0, y0, x1, y0, x1, y1, x0, y1, x0, y0]
    body = record(0x0D02, struct.pack(">h", layer)) + record(0x0E02, struct.pack(">h", 0))
    return record(0x0800) + body + record(0x1003, struct.pack(">10i", *corners)) + record(0x1100)


def layout(name, layers):
    date = struct.pack(">12h", *[2026, 1, 1, 0, 0, 0] * 2)
    stream = record(0x0002, struct.pack(">h", 600)) + record(0x0102, date) + record(0x0206, text(name))
    stream += record(0x0305, real(1e-3) + real(1e-9)) + record(0x0502, date) + record(0x0606, text(name))
    for layer, boxes in layers.items():
        for box in boxes:
            stream += boundary(layer, box)
    return stream + record(0x0700) + record(0x0400)


def main():
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent
    for name, layers in LAYOUTS.items():
        (folder / f"{name}.gds").write_bytes(layout(name, layers))


if __name__ == "__main__":
    main()
