"""A ketchup bottle that stands upright, with a flip cap whose tab reaches to the front."""

from dataclasses import dataclass, replace

import numpy as np

from artigrasp.arrays import Array
from artigrasp.assets.object_model import Colour, Mesh
from artigrasp.assets.open_set.hinged import Blueprint, Hinge
from artigrasp.assets.open_set.parameters import chosen, ranged
from artigrasp.assets.open_set.solids import Solid, detail, lathe, shell, slab
from artigrasp.assets.open_set.strokes import letters

_ARCTIC = "around ARCTIC's ketchup bottle: 0.21 by 0.08 by 0.075 m, 0.57 kg and a cap of 6 g"
_SQUARE = 2.3
_LEAF, _TOMATO, _CREAM = (0.05, 0.30, 0.05), (0.75, 0.03, 0.02), (0.92, 0.85, 0.66)


@dataclass(frozen=True)
class KetchupBottle:
    """Sizes, masses and colours of a ketchup bottle."""

    width: float = ranged(0.080, 0.070, 0.090, "m", _ARCTIC)
    roundness: float = ranged(0.80, 0.72, 0.92, "m", "depth over width")
    height: float = ranged(0.175, 0.155, 0.190, "m", "without the cap; " + _ARCTIC)
    cap_radius: float = ranged(0.024, 0.021, 0.026, "m", "ARCTIC's cap: 5 by 5 cm, 17 mm high")
    cap_height: float = ranged(0.022, 0.018, 0.026, "m", "ARCTIC's cap: 5 by 5 cm, 17 mm high")
    tab: float = ranged(0.010, 0.008, 0.013, "m", "what a fingertip takes hold of")
    base_mass: float = ranged(0.50, 0.35, 0.65, "kg", _ARCTIC)
    cap_mass: float = ranged(0.012, 0.008, 0.018, "kg", "polypropylene, 2 to 3 mm thick")
    colours: tuple[Colour, Colour] = chosen(
        ((0.62, 0.02, 0.015), (0.90, 0.88, 0.84)),
        ((0.48, 0.015, 0.02), (0.05, 0.25, 0.07)),
        ((0.70, 0.06, 0.02), (0.85, 0.62, 0.08)),
        ((0.40, 0.02, 0.02), (0.04, 0.04, 0.045)),
    )
    """Of the bottle and the cap."""

    def blueprint(self) -> Blueprint:
        """The bottle, its front at -y, standing on z = 0 with its middle above the origin."""
        bottle, cap = self.colours
        radius, top = self.cap_radius, self.height
        body = lathe(self._profile(), bottle, stretch=(1.0, self.roundness), square=_SQUARE)
        pale: Colour = (0.85 * cap[0], 0.85 * cap[1], 0.85 * cap[2])
        collar = lathe([(radius - 0.001, top - 0.014), (radius, top - 0.012), (radius, top)], pale)
        tip = top + 0.5 * self.cap_height
        nozzle = lathe([(0.007, top), (0.0045, tip - 0.003), (0.003, tip)], pale)
        low, high = top + 0.001, top + self.cap_height
        wall = shell([(radius, low), (radius, high - 0.0035)], 0.0025, cap, sectors=10)
        lid = lathe([(radius, high - 0.0035), (radius, high - 0.001), (radius - 0.002, high)], cap)
        tab = slab((-0.010, -radius - self.tab, low), (0.010, -radius + 0.003, low + 0.005), cap, corner=0.006)
        pin = lathe([(0.0028, -0.008), (0.0028, 0.008)], pale, middle=(radius + 0.0015, low), axis="x")
        return Blueprint(
            base=[body, collar, nozzle, detail(pin), *self._label()],
            base_mass=self.base_mass,
            articulated=[wall, lid, tab],
            articulated_mass=self.cap_mass,
            hinge=Hinge((0.0, radius + 0.001, low), (-1.0, 0.0, 0.0), upper=2.4, damping=0.0005),
        )

    def _profile(self) -> list[tuple[float, float]]:
        """Half the width at heights [m]."""
        half, top, neck = self.width / 2, self.height - 0.014, self.cap_radius - 0.0035
        shares = [(0.88, 0.0), (0.97, 0.025), (1.0, 0.30), (0.985, 0.60), (0.90, 0.78), (0.76, 0.90)]
        return [*((share * half, height * top) for share, height in shares), (max(neck, 0.5 * half), top)]

    def _label(self) -> list[Solid]:
        """A cream label all around between two green stripes, a tomato and the bottle's name on it."""
        bottom, top = 0.30 * self.height, 0.66 * self.height
        bands = [
            self._band(bottom, top, 0.0005, _CREAM),
            self._band(bottom - 0.004, bottom, 0.0007, _LEAF),
            self._band(top, top + 0.004, 0.0007, _LEAF),
        ]
        # Rings within rings, so that it bends.
        rings = [(0.001, -0.0004), (0.005, -0.0004), (0.009, -0.0004), (0.013, -0.0004), (0.013, 0.0)]
        tomato = lathe(rings, _TOMATO, axis="y").moved((0, 0, 0.002))
        leaves = [
            slab((-0.0025, -0.0006, 0.008), (0.0025, 0, 0.020), _LEAF, edge=0.0001, axis="y"),
            slab((-0.009, -0.0007, 0.0125), (0.009, 0, 0.0165), _LEAF, edge=0.0001, axis="y"),
        ]
        picture = [solid.moved((0, 0, bottom + 0.62 * (top - bottom))) for solid in (tomato, *leaves)]
        name = [
            solid.moved((0, 0, bottom + 0.18 * (top - bottom)))
            for solid in letters("KETCHUP", 0.18 * self.width / 0.08 * 0.05, _TOMATO)
        ]
        return [*bands, *(detail(self._bent(solid)) for solid in (*picture, *name))]

    def _band(self, low: float, high: float, thickness: float, colour: Colour) -> Solid:
        heights = np.linspace(low, high, 4 if high - low > 0.01 else 2)
        outside = [(float(self._half(height)) + thickness, float(height)) for height in heights]
        stretch = (1.0, self.roundness)
        return detail(shell(outside, thickness + 0.0002, colour, stretch=stretch, square=_SQUARE))

    def _half(self, height: Array | float) -> Array:
        radii, heights = np.array(self._profile()).T
        half: Array = np.interp(height, heights, radii)
        return half

    def _bent(self, solid: Solid) -> Solid:
        """A thin solid at y = 0, laid on the front of the label."""
        x, y, z = solid.shown.vertices.T
        radius = self._half(z)
        surface = self.roundness * radius * (1 - np.abs(x / radius).clip(max=0.999) ** _SQUARE) ** (1 / _SQUARE)
        bent = np.stack([x, y - surface - 0.0005, z], axis=1)
        return replace(solid, shown=Mesh(bent, solid.shown.faces))
