"""A round waffle iron: two shells with a grid each, and a handle in front of the upper one."""

from dataclasses import dataclass

import numpy as np

from artigrasp.assets.object_model import Colour
from artigrasp.assets.open_set.hinged import Blueprint, Hinge
from artigrasp.assets.open_set.parameters import chosen, ranged
from artigrasp.assets.open_set.solids import Solid, detail, lathe, shell, slab

_ARCTIC = "around ARCTIC's waffle iron: 0.20 by 0.17 by 0.09 m, 1.07 and 0.14 kg"
_IRON, _RIDGE, _STEEL, _BLACK = (0.035, 0.035, 0.04), (0.09, 0.09, 0.10), (0.52, 0.53, 0.55), (0.02, 0.02, 0.022)


@dataclass(frozen=True)
class WaffleIron:
    """Sizes, masses and colours of a waffle iron."""

    radius: float = ranged(0.092, 0.080, 0.105, "m", _ARCTIC)
    base_height: float = ranged(0.040, 0.034, 0.048, "m", "with feet; " + _ARCTIC)
    lid_height: float = ranged(0.034, 0.028, 0.042, "m", _ARCTIC)
    handle: float = ranged(0.065, 0.055, 0.080, "m", "length of the handle: three or four fingers beside each other")
    grip: float = ranged(0.011, 0.009, 0.012, "m", "half its thickness")
    base_mass: float = ranged(1.00, 0.75, 1.30, "kg", _ARCTIC)
    lid_mass: float = ranged(0.28, 0.18, 0.40, "kg", "ARCTIC's: 0.14 kg, thinner than it looks")
    colours: Colour = chosen((0.42, 0.44, 0.46), (0.55, 0.03, 0.03), (0.05, 0.26, 0.30), (0.82, 0.72, 0.52))
    """Of the shells."""

    def blueprint(self) -> Blueprint:
        """The waffle iron, its handle at -y, standing on z = 0 with its middle above the origin."""
        r, low, top = self.radius, self.base_height, self.base_height + self.lid_height
        foot, gap = 0.008, 0.0015
        bottom = low + gap
        base = lathe([(0.78 * r, foot), (0.97 * r, foot + 0.008), (r, low - 0.008), (r, low)], self.colours)
        rim = detail(shell([(r + 0.0008, low - 0.006), (r + 0.0008, low - 0.001)], 0.001, _STEEL))
        feet = [
            lathe([(0.009, 0), (0.011, foot + 0.002)], _BLACK, middle=(0.66 * r * np.cos(at), 0.66 * r * np.sin(at)))
            for at in np.pi / 4 * np.array([1, 3, 5, 7])
        ]
        back = r + 0.012
        hinge_block = slab((-0.026, 0.86 * r, foot + 0.002), (0.026, back - 0.001, low - 0.001), _BLACK, corner=0.004)
        profile = [(r, bottom), (r, bottom + 0.008), (0.93 * r, top - 0.008), (0.72 * r, top - 0.001), (0.5 * r, top)]
        ear = slab((-0.022, 0.80 * r, bottom + 0.001), (0.022, back, bottom + 0.016), _BLACK, corner=0.004)
        height = bottom + 0.012
        reach = -r - self.handle
        low_end, high_end = (-0.020, reach, height - self.grip), (0.020, -0.90 * r, height + self.grip)
        handle = slab(low_end, high_end, _BLACK, corner=0.016, edge=0.008)
        lamp = lathe([(0.006, top - 0.004), (0.005, top + 0.0015)], (0.95, 0.35, 0.05), middle=(0.022, -0.45 * r))
        ready = lathe([(0.006, top - 0.004), (0.005, top + 0.0015)], (0.10, 0.75, 0.15), middle=(-0.022, -0.45 * r))
        badge = lathe([(0.30 * r, top - 0.001), (0.28 * r, top + 0.0015)], _STEEL)
        return Blueprint(
            base=[base, rim, *feet, hinge_block, *self._grid(low, 1)],
            base_mass=self.base_mass,
            articulated=[
                lathe(profile, self.colours), ear, handle, detail(lamp), detail(ready), detail(badge),
                *self._grid(bottom, -1),
            ],
            articulated_mass=self.lid_mass,
            hinge=Hinge((0.0, back, low + gap / 2), (-1.0, 0.0, 0.0), upper=1.9),
        )  # fmt: skip

    def _grid(self, height: float, up: int) -> list[Solid]:
        """A dark plate with ridges, on the face that looks up (1) or down (-1)."""
        r = 0.86 * self.radius

        def between(rise: float) -> tuple[float, float]:
            return min(height, height + up * rise), max(height, height + up * rise)

        near, far = between(0.0002)
        found = [detail(lathe([(r, near), (r, far)], _IRON))]
        near, far = between(0.0005)
        for across in np.linspace(-0.75, 0.75, 6) * r:
            half = 0.96 * np.sqrt(r**2 - across**2)
            for low, high in (
                ((across - 0.003, -half), (across + 0.003, half)),
                ((-half, across - 0.003), (half, across + 0.003)),
            ):
                found.append(detail(slab((*low, near), (*high, far), _RIDGE, corner=0, edge=0)))
        return found
