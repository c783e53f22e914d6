"""An espresso machine: a group head over a drip tray and a cup, and a bow on top that lifts like a lever."""

from dataclasses import dataclass

import numpy as np

from artigrasp.assets.object_model import Colour
from artigrasp.assets.open_set.hinged import Blueprint, Hinge
from artigrasp.assets.open_set.parameters import chosen, ranged
from artigrasp.assets.open_set.solids import Solid, detail, lathe, slab, tube

_ARCTIC = "around ARCTIC's espresso machine: 0.26 by 0.22 by 0.18 m, 1.9 kg and a lever of 13 g"
_STEEL, _DARK, _BLACK = (0.55, 0.56, 0.58), (0.10, 0.10, 0.11), (0.02, 0.02, 0.022)
_CUP, _COFFEE = (0.90, 0.89, 0.86), (0.10, 0.04, 0.015)


@dataclass(frozen=True)
class EspressoMachine:
    """Sizes, masses and colours of an espresso machine."""

    width: float = ranged(0.150, 0.130, 0.175, "m", _ARCTIC)
    depth: float = ranged(0.230, 0.205, 0.255, "m", _ARCTIC)
    height: float = ranged(0.210, 0.195, 0.230, "m", "without the lever; " + _ARCTIC)
    arm: float = ranged(0.165, 0.150, 0.180, "m", "length of the lever; ARCTIC's is 0.08 m")
    bar: float = ranged(0.008, 0.007, 0.009, "m", "radius of the lever")
    base_mass: float = ranged(1.90, 1.40, 2.40, "kg", _ARCTIC)
    lever_mass: float = ranged(0.10, 0.06, 0.15, "kg", "a steel tube of this size")
    colours: Colour = chosen((0.08, 0.26, 0.28), (0.04, 0.045, 0.05), (0.78, 0.74, 0.66), (0.58, 0.05, 0.04))
    """Of the case."""

    def blueprint(self) -> Blueprint:
        """The machine, its front at -y, standing on z = 0 with its middle above the origin."""
        x, y, top = self.width / 2, self.depth / 2, self.height
        tray, under = 0.036, top - 0.062
        hinge = (0.0, -y + 0.002 + self.arm - 0.012, top + 0.014)
        column = 0.004
        group = (0.0, -y + 0.058)
        case = [
            slab((-x, -y, 0.0), (x, y, tray), self.colours, corner=0.016, edge=0.004),
            slab((-x, column, tray), (x, y, under), self.colours, corner=0.012, edge=0),
            slab((-x, -y + 0.018, under), (x, y, top), self.colours, corner=0.016, edge=0.005),
        ]
        front = column - 0.0008
        panel = slab((-x + 0.012, front, tray + 0.004), (x - 0.012, column, under), _STEEL, corner=0, edge=0)
        pivots = [
            lathe([(0.011, side - 0.005), (0.011, side + 0.005)], _STEEL, middle=(hinge[1], hinge[2]), axis="x")
            for side in (-x + 0.012, x - 0.012)
        ]
        posts = [
            slab(
                (side - 0.006, hinge[1] - 0.008, top - 0.002),
                (side + 0.006, hinge[1] + 0.008, hinge[2]),
                _STEEL,
                edge=0,
            )
            for side in (-x + 0.012, x - 0.012)
        ]
        return Blueprint(
            base=[*case, detail(panel), *self._group(group, under), *self._cup(group, tray), *self._tray(tray, column),
                  *map(detail, pivots), *map(detail, posts), *self._front(-y + 0.018, under, top)],
            base_mass=self.base_mass,
            articulated=self._lever(hinge),
            articulated_mass=self.lever_mass,
            hinge=Hinge(hinge, (-1.0, 0.0, 0.0), upper=1.65),
        )  # fmt: skip

    def _lever(self, hinge: tuple[float, float, float]) -> list[Solid]:
        x, (_, back, height) = self.width / 2 - 0.012, hinge
        end = back - self.arm
        path = [(-x, back, height), (-x, end + 0.02, height), (-x + 0.02, end, height)]
        bow = tube(path + [(-a, b, c) for a, b, c in reversed(path)], self.bar, _STEEL)
        grip = lathe([(self.bar + 0.003, -x + 0.030), (self.bar + 0.0035, 0.0), (self.bar + 0.003, x - 0.030)], _BLACK,
                     middle=(end, height), axis="x")  # fmt: skip
        return [bow, grip]

    def _group(self, middle: tuple[float, float], under: float) -> list[Solid]:
        """The group head, and the filter holder in it with its handle to the front."""
        head = lathe([(0.025, under - 0.020), (0.030, under - 0.014), (0.030, under)], _STEEL, middle=middle)
        filter_low = under - 0.038
        holder = lathe([(0.022, filter_low), (0.027, filter_low + 0.005), (0.027, under - 0.020)], _DARK, middle=middle)
        spout = lathe([(0.006, filter_low - 0.012), (0.009, filter_low)], _STEEL, middle=middle)
        height = filter_low + 0.008
        neck = lathe([(0.009, middle[1] - 0.082), (0.011, middle[1] - 0.060), (0.007, middle[1] - 0.024)], _BLACK,
                     middle=(height, middle[0]), axis="y")  # fmt: skip
        return [head, holder, detail(spout), neck]

    def _cup(self, middle: tuple[float, float], tray: float) -> list[Solid]:
        """A small cup of coffee on the tray."""
        profile = [(0.012, tray + 0.002), (0.018, tray + 0.012), (0.021, tray + 0.030), (0.021, tray + 0.032)]
        coffee = lathe([(0.0185, tray + 0.032), (0.0185, tray + 0.0324)], _COFFEE, middle=middle)
        angles = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 7)
        loop = [(middle[0] + 0.019 + 0.009 * np.cos(at), middle[1], tray + 0.019 + 0.008 * np.sin(at)) for at in angles]
        return [lathe(profile, _CUP, middle=middle), detail(coffee), detail(tube(loop, 0.002, _CUP, sides=6))]

    def _tray(self, tray: float, column: float) -> list[Solid]:
        """A grid over a dark pan."""
        x, y = self.width / 2 - 0.014, self.depth / 2
        near, far = -y + 0.010, column - 0.004
        pan = slab((-x, near, tray), (x, far, tray + 0.0005), _BLACK, corner=0.006, edge=0)
        bars = [
            slab((at - 0.002, near + 0.002, tray), (at + 0.002, far - 0.002, tray + 0.002), _STEEL, corner=0, edge=0)
            for at in np.linspace(-x + 0.006, x - 0.006, 10)
        ]
        return [detail(pan), *map(detail, bars)]

    def _front(self, front: float, under: float, top: float) -> list[Solid]:
        """A pressure gauge and three buttons."""
        x, height = self.width / 2, (under + top) / 2
        gauge = -0.55 * x
        hand = (gauge - 0.001, front - 0.0042, height), (gauge + 0.001, front - 0.0036, height + 0.013)
        found = [
            lathe([(0.019, front - 0.003), (0.020, front)], _STEEL, middle=(height, gauge), axis="y"),
            lathe([(0.016, front - 0.0036), (0.016, front - 0.003)], _CUP, middle=(height, gauge), axis="y"),
            lathe([(0.003, front - 0.005), (0.003, front - 0.0036)], _BLACK, middle=(height, gauge), axis="y"),
            slab(*hand, (0.8, 0.05, 0.03), corner=0, edge=0),
        ]
        for index, colour in enumerate((_STEEL, _STEEL, (0.95, 0.45, 0.08))):
            at = (0.10 + 0.30 * index) * x
            found.append(lathe([(0.0075, front - 0.004), (0.0085, front)], colour, middle=(height, at), axis="y"))
        return list(map(detail, found))
