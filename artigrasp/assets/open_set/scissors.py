"""A pair of scissors lying flat: two thin blades, and a loop for the fingers at the end of each."""

from dataclasses import dataclass

import numpy as np

from artigrasp.arrays import Array
from artigrasp.assets.object_model import Colour
from artigrasp.assets.open_set.hinged import Blueprint, Hinge
from artigrasp.assets.open_set.parameters import chosen, ranged
from artigrasp.assets.open_set.solids import Solid, detail, lathe, prism, tube

_SHOP = "office and household scissors of 16 to 22 cm"
_STEEL, _PIVOT = (0.58, 0.60, 0.62), (0.30, 0.31, 0.33)


@dataclass(frozen=True)
class Scissors:
    """Sizes, masses and colours of a pair of scissors."""

    blade: float = ranged(0.095, 0.080, 0.110, "m", "from the pivot to the tips; " + _SHOP)
    shank: float = ranged(0.052, 0.046, 0.060, "m", "from the pivot to the loops; " + _SHOP)
    loop_length: float = ranged(0.060, 0.054, 0.068, "m", "of the loops, outside; " + _SHOP)
    loop_width: float = ranged(0.042, 0.038, 0.046, "m", "of the loops, outside; " + _SHOP)
    bar: float = ranged(0.0050, 0.0045, 0.0056, "m", "radius of the loops' bars: half the scissors' thickness")
    mass: float = ranged(0.045, 0.032, 0.060, "kg", "each half; " + _SHOP)
    colours: Colour = chosen((0.75, 0.10, 0.03), (0.05, 0.20, 0.45), (0.03, 0.30, 0.18), (0.03, 0.03, 0.035))
    """Of the loops."""

    def blueprint(self) -> Blueprint:
        """The scissors, their loops at -y, lying on z = 0, the pivot above the origin."""
        middle = self.bar
        screw = lathe([(0.006, 0.0005), (0.006, 2 * middle - 0.0003), (0.0045, 2 * middle)], _PIVOT)
        return Blueprint(
            base=[*self._half(-1, middle - 0.0030, middle - 0.0001), detail(screw)],
            base_mass=self.mass,
            articulated=self._half(1, middle + 0.0001, middle + 0.0030),
            articulated_mass=self.mass,
            hinge=Hinge((0.0, 0.0, middle), (0.0, 0.0, 1.0), upper=1.2, damping=0.001),
        )

    def _half(self, side: int, low: float, high: float) -> list[Solid]:
        """A blade between two heights, and its loop on the left (-1) or right (1)."""
        tip, heel = self.blade, -0.45 * self.shank
        right = [(0.008, -0.008), (0.0085, 0.012), (0.0022, 0.97 * tip)]
        blade = [*right, (0.0, tip), *((-across, along) for across, along in reversed(right))]
        out = 0.012 + self.loop_width / 2
        tang = [(0.004, -0.006), (0.013, heel), (0.006, heel - 0.004), (-0.008, -0.006)]
        end = -self.shank - 0.004
        grip = [(0.0145, heel + 0.004), (out + 0.003, end), (out - 0.010, end), (0.003, heel)]
        loop = self._loop(np.array([side * out, -self.shank - self.loop_length / 2 + 0.004, self.bar]))
        # The plastic is thicker, away from the other half.
        bottom, top = (low - 0.0008, high) if side < 0 else (low, high + 0.0008)
        return [
            prism(blade, low, high, _STEEL, density=6.0),
            prism(_facing(tang, side), low, high, _STEEL, density=6.0),
            prism(_facing(grip, side), bottom, top, self.colours, edge=0.0008),
            loop,
        ]

    def _loop(self, middle: Array) -> Solid:
        angles = 2 * np.pi * np.arange(14) / 14
        reach = self.loop_width / 2 - self.bar, self.loop_length / 2 - self.bar
        ring = np.stack([reach[0] * np.cos(angles), reach[1] * np.sin(angles), np.zeros(14)], axis=1)
        return tube(middle + ring, self.bar, self.colours, closed=True)


def _facing(corners: list[tuple[float, float]], side: int) -> list[tuple[float, float]]:
    """Corners of the right half, clockwise, for one side: counter-clockwise for either."""
    return [(-x, y) for x, y in corners] if side < 0 else corners[::-1]
