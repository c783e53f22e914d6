"""A stand mixer: its head, with the beater, tilts back from over the bowl."""

from dataclasses import dataclass, replace

from artigrasp.assets.object_model import Colour
from artigrasp.assets.open_set.hinged import Blueprint, Hinge
from artigrasp.assets.open_set.parameters import chosen, ranged
from artigrasp.assets.open_set.solids import Solid, detail, lathe, prism, shell, slab, tube

_ARCTIC = "ARCTIC's mixer, a toy: 0.19 by 0.17 by 0.10 m, 0.59 and 0.18 kg"
_REAL = "real ones are 0.35 m long; between them and " + _ARCTIC
_STEEL, _BLACK = (0.55, 0.56, 0.58), (0.03, 0.03, 0.035)


@dataclass(frozen=True)
class Mixer:
    """Sizes, masses and colours of a stand mixer."""

    length: float = ranged(0.230, 0.205, 0.255, "m", _REAL)
    width: float = ranged(0.120, 0.108, 0.135, "m", _REAL)
    column: float = ranged(0.132, 0.122, 0.145, "m", "height of the hinge; " + _REAL)
    head: float = ranged(0.042, 0.037, 0.047, "m", "half the head's thickness")
    bowl: float = ranged(0.054, 0.048, 0.058, "m", "radius of the bowl")
    base_mass: float = ranged(0.90, 0.70, 1.20, "kg", _ARCTIC)
    head_mass: float = ranged(0.28, 0.20, 0.38, "kg", _ARCTIC)
    colours: Colour = chosen((0.62, 0.04, 0.05), (0.25, 0.55, 0.52), (0.85, 0.80, 0.68), (0.06, 0.12, 0.26))
    """Of the case."""

    def blueprint(self) -> Blueprint:
        """The mixer, its front at -y, standing on z = 0 with its middle above the origin."""
        x, y, plate = self.width / 2, self.length / 2, 0.022
        bowl = -y + 0.008 + self.bowl
        behind = y - 0.036
        foot = slab((-x, -y, 0.0), (x, y, plate), self.colours, corner=0.045, edge=0.006)
        profile = [(0.034, plate - 0.002), (0.029, plate + 0.03), (0.028, self.column - 0.003)]
        column = lathe(profile, self.colours, middle=(0, behind), square=3.0)
        knob = lathe([(0.011, 0.026), (0.009, 0.036)], _BLACK, middle=(behind, 0.55 * self.column), axis="x")
        cheeks = []
        for side in (-0.022, 0.016):
            low, high = (side, y - 0.030, self.column - 0.030), (side + 0.006, y - 0.002, self.column + 0.010)
            cheeks.append(slab(low, high, self.colours, corner=0.010, edge=0, axis="x"))
            pin = [(0.006, side - 0.001), (0.006, side + 0.007)]
            cheeks.append(lathe(pin, _STEEL, middle=(y - 0.012, self.column), axis="x"))
        return Blueprint(
            base=[foot, column, detail(knob), *map(detail, cheeks), *self._bowl(bowl, plate)],
            base_mass=self.base_mass,
            articulated=self._head(bowl),
            articulated_mass=self.head_mass,
            hinge=Hinge((0.0, y - 0.012, self.column), (-1.0, 0.0, 0.0), upper=1.6),
        )

    def _bowl(self, middle: float, plate: float) -> list[Solid]:
        r, rim = self.bowl, plate + 0.062
        wall = [(0.60 * r, plate + 0.005), (0.90 * r, plate + 0.028), (r, rim)]
        floor = lathe([(0.62 * r, plate - 0.001), (0.60 * r, plate + 0.006)], _STEEL, middle=(0, middle))
        edge = [(r + 0.0015, rim - 0.003), (r + 0.0015, rim + 0.0005)]
        return [
            replace(floor, density=0.5),
            shell(wall, 0.003, _STEEL, middle=(0, middle), sectors=10, density=0.5),
            detail(shell(edge, 0.0047, _STEEL, middle=(0, middle))),
        ]

    def _head(self, bowl: float) -> list[Solid]:
        """A head like a bullet, its nose in front, and a beater below it."""
        y, h = self.length / 2, self.head
        height = self.column + 0.002 + h
        shares = ((0.50, 0.0), (0.72, 0.015), (0.87, 0.05), (0.96, 0.12), (1.0, 0.25), (1.0, 0.50), (0.96, 0.75),
                  (0.88, 0.88), (0.74, 0.96), (0.48, 1.0))  # fmt: skip
        near, length = -y - 0.006, 2 * y + 0.002
        profile = [(share * h, near + at * length) for share, at in shares]
        wide = (1.0, 1.08)
        body = lathe(profile, self.colours, middle=(height, 0.0), stretch=wide, square=2.4, axis="y")
        trim = [(1.012 * h, near + 0.60 * length), (1.005 * h, near + 0.65 * length)]
        band = lathe(trim, _STEEL, middle=(height, 0.0), stretch=wide, square=2.4, axis="y")
        low, high = (-0.015, y - 0.034, self.column - 0.004), (0.015, y - 0.006, height)
        lug = slab(low, high, self.colours, corner=0.006, edge=0, axis="x")
        nose = lathe([(0.40 * h, -y - 0.010), (0.42 * h, -y - 0.006)], _STEEL, middle=(height, 0.0), axis="y")
        lever = lathe([(0.008, 1.02 * h), (0.006, 1.02 * h + 0.012)], _BLACK, middle=(0.45 * y, height), axis="x")
        return [body, *map(detail, (band, lug, nose, lever)), *self._beater(bowl, height - 0.9 * h)]

    def _beater(self, middle: float, top: float) -> list[Solid]:
        shaft = lathe([(0.006, top - 0.030), (0.006, top + 0.004)], _STEEL, middle=(0, middle))
        low, half = 0.022 + 0.018, 0.5 * self.bowl
        high = top - 0.024
        outline = [(0.0, low), (0.7 * half, low + 0.006), (half, 0.6 * low + 0.4 * high), (0.2 * half, high)]
        corners = outline + [(-a, b) for a, b in reversed(outline[1:])]
        # Prisms across y have their corners as (z, x).
        blade = prism([(b, a) for a, b in reversed(corners)], middle - 0.003, middle + 0.003, _STEEL, axis="y")
        frame = tube([(a, middle, b) for a, b in corners], 0.0028, _STEEL, closed=True, sides=6)
        spoke = tube([(0, middle, low), (0, middle, high)], 0.0025, _STEEL, sides=6)
        # A frame to look at, a blade to touch.
        return [shaft, detail(spoke), replace(frame, pieces=blade.pieces, density=0.3)]
