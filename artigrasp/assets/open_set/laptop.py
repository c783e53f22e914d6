"""A sturdy laptop on feet: keys, a touch pad, a picture on its screen, and a lid that reaches beyond the front."""

from dataclasses import dataclass

from artigrasp.assets.object_model import Colour
from artigrasp.assets.open_set.hinged import Blueprint, Hinge
from artigrasp.assets.open_set.parameters import chosen, ranged
from artigrasp.assets.open_set.solids import Solid, detail, prism, slab

_ARCTIC = "around ARCTIC's laptop: 0.33 by 0.20 m, 0.90 and 0.15 kg"
_KEY_ROWS, _KEYS = 5, 13
_SKY, _HILL, _MEADOW, _SUN = (0.10, 0.36, 0.72), (0.05, 0.22, 0.20), (0.10, 0.42, 0.22), (1.0, 0.75, 0.25)


@dataclass(frozen=True)
class Laptop:
    """Sizes, masses and colours of a laptop."""

    width: float = ranged(0.32, 0.28, 0.36, "m", "13 to 16 inch laptops; ARCTIC's: 0.33")
    depth: float = ranged(0.215, 0.195, 0.25, "m", "13 to 16 inch laptops; ARCTIC's: 0.20")
    height: float = ranged(0.026, 0.022, 0.032, "m", "of the half with the keys; ARCTIC's laptop is 0.06 high in all")
    feet: float = ranged(0.010, 0.008, 0.012, "m", "of rubber, so that fingers come under the lip")
    lid: float = ranged(0.009, 0.007, 0.012, "m", "thickness of the half with the screen")
    lip: float = ranged(0.016, 0.014, 0.020, "m", "what a fingertip takes hold of")
    base_mass: float = ranged(0.95, 0.75, 1.30, "kg", _ARCTIC)
    lid_mass: float = ranged(0.22, 0.15, 0.30, "kg", _ARCTIC)
    colours: tuple[Colour, Colour] = chosen(
        ((0.55, 0.57, 0.60), (0.02, 0.02, 0.025)),
        ((0.09, 0.10, 0.12), (0.015, 0.015, 0.02)),
        ((0.70, 0.52, 0.40), (0.80, 0.78, 0.75)),
        ((0.16, 0.24, 0.34), (0.02, 0.03, 0.05)),
    )
    """Of the case and the keys."""

    def blueprint(self) -> Blueprint:
        """The laptop, its front at -y, standing on z = 0 with its middle above the origin."""
        x, y, top = self.width / 2, self.depth / 2, self.feet + self.height
        case, keys = self.colours
        dark: Colour = (0.6 * case[0], 0.6 * case[1], 0.6 * case[2])
        low, front = top + 0.002, -y - self.lip
        base = slab((-x, -y, self.feet), (x, y - 0.004, top), case, corner=0.012, edge=0.003)
        pad = slab((-0.05, -y + 0.012, top - 0.0002), (0.05, -0.30 * y, top + 0.0004), dark, corner=0.005, edge=0)
        deck = slab((-x + 0.018, -0.22 * y, top - 0.0002), (x - 0.018, 0.80 * y, top + 0.0003), dark, edge=0)
        bar = slab((-0.8 * x, y - 0.007, top - 0.004), (0.8 * x, y + 0.001, low + 0.003), keys, corner=0.004, axis="x")
        feet = [
            slab((-0.85 * x, at - 0.008, 0), (0.85 * x, at + 0.008, self.feet), keys, corner=0.007, density=0.5)
            for at in (-y + 0.020, y - 0.024)
        ]
        return Blueprint(
            base=[base, *feet, detail(pad), detail(deck), detail(bar), *self._keys(keys, -0.20 * y, 0.78 * y)],
            base_mass=self.base_mass,
            articulated=[
                slab((-x, front, low), (x, y, low + self.lid), case, corner=0.012, edge=0.003),
                *self._screen(front, low),
                self._emblem(low + self.lid, (front + y) / 2),
            ],
            articulated_mass=self.lid_mass,
            hinge=Hinge((0.0, y, low), (-1.0, 0.0, 0.0), upper=2.4),
        )

    def _keys(self, colour: Colour, near: float, far: float) -> list[Solid]:
        """Rows of keys, in the nearest of them the space bar."""
        found = []
        left, pitch, rise = -self.width / 2 + 0.020, (self.width - 0.040) / _KEYS, (far - near) / _KEY_ROWS
        top = self.feet + self.height
        for row in range(_KEY_ROWS):
            columns = [(key, key + 1) for key in range(_KEYS)]
            if row == 0:
                columns = [*columns[:3], (3, 9), *columns[9:]]
            for first, end in columns:
                corner = left + first * pitch + 0.001, near + row * rise + 0.001, top
                other = left + end * pitch - 0.001, near + (row + 1) * rise - 0.001, top + 0.0012
                found.append(detail(slab(corner, other, colour, corner=0, edge=0)))
        return found

    def _screen(self, front: float, low: float) -> list[Solid]:
        """The picture below the lid: hills in the evening."""
        x, back = self.width / 2 - 0.010, self.depth / 2 - 0.022
        near, middle = front + 0.010, low + 0.0001

        def layer(corners: list[tuple[float, float]], depth: int, colour: Colour) -> Solid:
            return detail(prism(corners, low - 0.00015 * depth, middle, colour))

        frame = [
            (-x - 0.004, near - 0.004),
            (x + 0.004, near - 0.004),
            (x + 0.004, back + 0.01),
            (-x - 0.004, back + 0.01),
        ]
        height = back - near
        sun = slab(
            (-0.45 * x, near + 0.2 * height, low - 0.00045),
            (-0.45 * x + 0.04, near + 0.2 * height + 0.04, middle),
            _SUN,
            corner=0.02,
            edge=0,
        )
        return [
            layer(frame, 1, (0.012, 0.012, 0.015)),
            layer([(-x, near), (x, near), (x, back), (-x, back)], 2, _SKY),
            detail(sun),
            layer([(-0.2 * x, back), (0.45 * x, back - 0.55 * height), (x, back - 0.25 * height), (x, back)], 4, _HILL),
            layer(
                [(-x, back), (-x, back - 0.35 * height), (-0.5 * x, back - 0.42 * height), (0.6 * x, back)], 5, _MEADOW
            ),
        ]

    def _emblem(self, top: float, middle: float) -> Solid:
        """A round mark on the lid."""
        case, _ = self.colours
        dark: Colour = (0.45 * case[0], 0.45 * case[1], 0.5 * case[2])
        low, high = (-0.016, middle - 0.016, top - 0.0002), (0.016, middle + 0.016, top + 0.0004)
        return detail(slab(low, high, dark, corner=0.016, edge=0))
