#!/usr/bin/env python3
"""Draws the pictures of docs/metrology.md: python3 docs/metrology/draw.py writes the .svg files beside it."""

import math
import pathlib

SOLID, FILM, MASK, INK, AID = "#b8bec6", "#5b9bd5", "#cc79a7", "#222222", "#b22222"
HERE = pathlib.Path(__file__).parent


class Drawing:
    """A picture in pixels with z upwards from its middle line."""

    def __init__(self, name, width=420, height=270, zero=50):
        self.name, self.width, self.height, self.zero = name, width, height, zero
        self.items = []

    def at(self, point):
        return f"{self.width / 2 + point[0]:.1f} {self.zero - point[1]:.1f}"

    def line(self, points, colour=INK, width=1.2, dash="", fill="none"):
        path = "M" + "L".join(self.at(p) for p in points)
        style = f' stroke-dasharray="{dash}"' if dash else ""
        self.items.append(f'<path d="{path}" fill="{fill}" stroke="{colour}" stroke-width="{width}"{style}/>')

    def solid(self, outline, fill=SOLID):
        """What lies below an outline from left to right."""
        edge = self.width / 2
        bottom = self.zero - self.height
        points = [(-edge, outline[0][1])] + outline + [(edge, outline[-1][1])]
        path = "M" + "L".join(self.at(p) for p in [(-edge, bottom)] + points + [(edge, bottom)]) + "Z"
        self.items.append(f'<path d="{path}" fill="{fill}"/>')
        self.line(points)

    def text(self, point, words, anchor="start"):
        x, y = self.at(point).split()
        self.items.append(f'<text x="{x}" y="{float(y) + 4:.1f}" text-anchor="{anchor}">{words}</text>')

    def arrow(self, a, b, words="", where=None, anchor="start"):
        """A measure with a head at both ends; words beside its middle."""
        self.line([a, b], AID, 1.4)
        length = math.hypot(b[0] - a[0], b[1] - a[1])
        ux, uz = (b[0] - a[0]) / length, (b[1] - a[1]) / length
        head = min(6, length / 3)
        for tip, sign in ((a, 1), (b, -1)):
            for side in (-0.45, 0.45):
                self.line([tip, (tip[0] + sign * head * (ux - side * uz), tip[1] + sign * head * (uz + side * ux))],
                          AID, 1.4)
        if words:
            self.text(where or ((a[0] + b[0]) / 2 + 6, (a[1] + b[1]) / 2), words, anchor)

    def aid(self, a, b):
        self.line([a, b], AID, 0.8, "4 3")

    def write(self):
        (HERE / f"{self.name}.svg").write_text(
            f'<svg xmlns="http://www.w3.org/2000/svg" width="{self.width}" height="{self.height}" '
            f'viewBox="0 0 {self.width} {self.height}" font-family="sans-serif" font-size="12" fill="{INK}">\n'
            f'<rect width="100%" height="100%" fill="#fff"/>\n' + "\n".join(self.items) + "\n</svg>\n")


def both(left):
    return left + [(-x, z) for x, z in reversed(left)]


def arc(x, z, r, start, end, parts=30):
    angles = [math.radians(start + (end - start) * n / parts) for n in range(parts + 1)]
    return [(x + r * math.cos(a), z + r * math.sin(a)) for a in angles]


def openings():
    d = Drawing("openings", 520, 210)
    ridge = -28
    d.solid([(-190, 0), (-184, -130), (-126, -130), (-120, 0), (-40, 0), (-34, -60), (4, -60), (10, 0),
             (80, 0), (86, -120), (130, -120), (136, -105), (142, -120), (186, -120), (192, 0)])
    for x in (-80, 45):
        d.aid((x, 25), (x, 0))
        d.text((x, 34), "field", "middle")
    for x, words in ((-155, "1"), (-15, "2"), (136, "3")):
        d.text((x, ridge), words, "middle")
    d.arrow((-120, 14), (-80, 14))
    d.arrow((-80, 14), (-40, 14))
    d.text((136, -60), "one: the ridge", "middle")
    d.text((136, -75), "is low", "middle")
    d.write()


def depth_cd():
    d = Drawing("depth_cd")
    wall = lambda part: 80 - 22 * part
    d.solid(both([(-80, 0), (-58, -180), (-20, -190), (0, -192)]))
    for part, words in ((0.1, "top CD"), (0.5, "middle CD"), (0.9, "bottom CD")):
        z = -192 * part
        x = wall(-z / 180)
        d.arrow((-x, z), (x, z), words, (0, z + 9), "middle")
        d.text((88, z), f"{part:.0%} of the depth")
    d.aid((-205, 0), (-80, 0))
    d.aid((-205, -192), (0, -192))
    d.arrow((-150, 0), (-150, -192), "depth")
    d.text((-200, 12), "field")
    d.write()


def necks():
    d = Drawing("neck_bow")
    left = [(-60, 0)] + [(-60 + 22 * math.sin(math.pi * s), -45 * s) for s in [n / 20 for n in range(21)]]
    left += [(-60 - 45 * math.sin(math.pi * s), -45 - 145 * s) for s in [n / 40 for n in range(39)]]
    d.solid(both([p for p in left] + [(-50, -190)]))
    d.arrow((-38, -22.5), (38, -22.5), "neck CD", (0, -13), "middle")
    d.arrow((-105, -117.5), (105, -117.5), "top CD + bow", (0, -108), "middle")
    d.aid((105, -117.5), (200, -117.5))
    d.aid((60, 0), (205, 0))
    d.aid((38, -22.5), (150, -22.5))
    d.arrow((180, 0), (180, -117.5))
    d.text((176, -70), "bow depth", "end")
    d.arrow((140, 0), (140, -22.5))
    d.text((134, 12), "neck depth", "middle")
    d.write()


def angle():
    d = Drawing("sidewall_angle")
    ripple = lambda z: 3 * math.sin(z / 7)
    left = [(-90 - z * 0.2 + ripple(z), z) for z in range(0, -181, -3)]
    d.solid(both(left + [(0, -180)]))
    for part in (0.2, 0.8):
        d.aid((-190, -180 * part), (60, -180 * part))
        d.text((-200, -180 * part + 10), f"{part:.0%}")
    d.line([(-90 + 0.2 * 36, -36), (-90 + 0.2 * 144, -144)], AID, 2)
    d.line([(-90 + 0.2 * 144, -144), (-150, -144)], AID, 1)
    d.line([(-61 + 40 * math.cos(a), -144 + 40 * math.sin(a)) for a in
            [math.radians(180 - n * (101 - 22) / 20) for n in range(21)]], AID, 1.2)
    d.text((-120, -125), "angle", "end")
    d.text((-2, -80), "least squares", "middle")
    d.text((-2, -96), "over both walls", "middle")
    d.write()


def mask():
    d = Drawing("mask", 460, 270, 90)
    under = arc(-40, 0, 55, 180, 270)
    silicon = both([(-150, 0)] + under + [(-40, -55), (-30, -120)])
    top = both([(-150, 40), (-40, 40), (-40, 0)] + under + [(-40, -55), (-30, -120)])
    d.solid(top, MASK)
    d.solid(silicon)
    d.line([(-230, 60), (-40, 60), (-40, 40)], AID, 1, "4 3")
    d.line([(40, 40), (40, 60), (230, 60)], AID, 1, "4 3")
    d.arrow((-95, 10), (-40, 10), "undercut", (-68, 20), "middle")
    d.aid((-95, 14), (-95, 0))
    d.arrow((-200, 0), (-200, 40), "mask thickness", (-194, 18))
    d.arrow((150, 40), (150, 60), "mask loss", (156, 50))
    d.text((-225, 70), "mask at the start")
    d.aid((-40, -120), (170, -120))
    d.arrow((130, 0), (130, -120), "etched depth", (136, -60))
    d.text((0, -150), "selectivity = etched depth / mask loss", "middle")
    d.write()


def facet():
    d = Drawing("facet_width", 420, 200)
    d.solid(both([(-130, 0), (-80, -50), (-76, -130)]))
    d.aid((-130, 30), (-130, 0))
    d.aid((-80, 30), (-80, -50))
    d.arrow((-130, 22), (-80, 22), "facet width", (-75, 22))
    d.text((-70, -30), "15 to 75 deg")
    d.text((-66, -90), "steeper")
    d.text((-200, -12), "flatter: field")
    d.write()


def scallops():
    d = Drawing("scallops", 420, 290)
    left = [(-70, 0)]
    for n in range(4):
        left += arc(-40, -30 - 55 * n, 42, 180 - 41, 180 + 41)
    d.solid(both(left))
    for z in (-57.5, -112.5):
        d.aid((-72, z), (40, z))
    d.arrow((10, -57.5), (10, -112.5), "pitch")
    cusp = -40 - 42 * math.cos(math.radians(41))
    d.aid((cusp, -57.5), (cusp, -112.5))
    d.arrow((-82, -85), (cusp, -85))
    d.text((cusp + 6, -85), "amplitude")
    d.write()


def micro():
    d = Drawing("micro_trenching", 460, 220)
    d.solid(both([(-80, 0), (-76, -150), (-70, -160), (-60, -150), (-30, -136), (0, -134)]))
    d.aid((-70, -160), (130, -160))
    d.aid((0, -134), (130, -134))
    d.arrow((110, -134), (110, -160))
    d.text((118, -147), "micro-trenching", "start")
    d.write()


def films():
    d = Drawing("films", 420, 300, 80)
    d.solid(both([(-58, 36), (-66, 20), (-74, -60), (-72, -158)]), FILM)
    d.solid(both([(-100, 0), (-96, -180)]))
    d.arrow((-170, 0), (-170, 36), "top", (-164, 18))
    d.arrow((-98, -90), (-73, -90), "wall", (-68, -90))
    d.aid((98, -90), (200, -90))
    d.text((110, -82), "half-way", "start")
    d.arrow((0, -180), (0, -158), "bottom", (6, -168))
    d.text((0, 66), "step coverage = bottom / top, wall coverage = wall / top", "middle")
    d.text((0, 50), "conformality = thinnest / thickest", "middle")
    d.write()


def roughness():
    d = Drawing("roughness", 420, 230)
    wave = lambda y, k: 4 * math.sin(y / 17 + k) + 3 * math.sin(y / 7 + 2 * k)
    lower = [(x, -40 + wave(x, 0)) for x in range(-200, 201, 4)]
    upper = [(x, -130 + wave(x, 2)) for x in range(-200, 201, 4)]
    d.line([(-200, 10)] + lower + [(200, 10)], INK, 1.2, "", SOLID)
    d.line([(-200, -175)] + upper + [(200, -175)], INK, 1.2, "", SOLID)
    for n, x in enumerate(range(-180, 181, 40)):
        d.arrow((x, -40 + wave(x, 0)), (x, -130 + wave(x, 2)))
    d.text((0, 30), "a trench from above: up to 64 sections", "middle")
    d.text((0, -160), "line width roughness = 3 standard deviations of the middle CD", "middle")
    d.write()


def arde():
    d = Drawing("arde_lag", 460, 240)
    d.solid([(-200, 0), (-198, -180), (-92, -180), (-90, 0), (-30, 0), (-28, -160), (18, -160), (20, 0), (80, 0),
             (81, -130), (99, -130), (100, 0)])
    d.aid((-92, -180), (180, -180))
    d.arrow((90, -130), (90, -180), "lag x depth", (98, -156))
    d.arrow((-145, 0), (-145, -180), "depth", (-140, -90))
    d.text((-145, 14), "the widest", "middle")
    d.write()


def void():
    d = Drawing("void", 420, 230, 40)
    d.solid([(-100, 0), (100, 0)], FILM)
    hole = [(0, -30)] + [(26 * math.sin(math.pi * s) ** 0.7, -30 - 130 * s) for s in [n / 40 for n in range(1, 40)]] + [(0, -160)]
    d.line(hole + [(-x, z) for x, z in reversed(hole)], INK, 1.2, "", "#fff")
    d.aid((0, -30), (110, -30))
    d.aid((0, -160), (110, -160))
    d.arrow((90, -30), (90, -160), "height")
    d.text((0, -95), "area", "middle")
    d.text((100, -30), "highest")
    d.text((100, -160), "lowest")
    d.write()


for draw in (openings, depth_cd, necks, angle, mask, facet, scallops, micro, films, roughness, arde, void):
    draw()
