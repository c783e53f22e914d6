"""A small microwave: a door with a window and a bar to pull, a display and buttons beside it."""

from dataclasses import dataclass

from artigrasp.assets.object_model import Colour
from artigrasp.assets.open_set.hinged import Blueprint, Hinge
from artigrasp.assets.open_set.parameters import chosen, ranged
from artigrasp.assets.open_set.solids import Solid, detail, lathe, slab, tube
from artigrasp.assets.open_set.strokes import letters

_ARCTIC = "around ARCTIC's microwave: 0.28 by 0.24 by 0.14 m, 2.3 and 0.08 kg"
_GLASS, _STEEL, _GLOW = (0.012, 0.014, 0.018), (0.50, 0.52, 0.54), (0.15, 0.95, 0.45)


@dataclass(frozen=True)
class Microwave:
    """Sizes, masses and colours of a microwave."""

    width: float = ranged(0.30, 0.26, 0.34, "m", _ARCTIC)
    depth: float = ranged(0.22, 0.19, 0.25, "m", _ARCTIC)
    height: float = ranged(0.17, 0.14, 0.20, "m", _ARCTIC)
    panel: float = ranged(0.075, 0.065, 0.085, "m", "width of what has the buttons")
    door: float = ranged(0.018, 0.014, 0.022, "m", "thickness of the door")
    reach: float = ranged(0.036, 0.032, 0.042, "m", "how far the bar is from the door: a finger fits behind it")
    bar: float = ranged(0.006, 0.005, 0.007, "m", "radius of the bar")
    base_mass: float = ranged(2.2, 1.6, 2.8, "kg", _ARCTIC)
    door_mass: float = ranged(0.25, 0.15, 0.35, "kg", "a thin door of plastic and glass; ARCTIC's: 0.08 kg")
    colours: tuple[Colour, Colour] = chosen(
        ((0.80, 0.79, 0.76), (0.12, 0.12, 0.13)),
        ((0.06, 0.065, 0.07), (0.03, 0.03, 0.035)),
        ((0.22, 0.48, 0.46), (0.85, 0.84, 0.80)),
        ((0.62, 0.09, 0.07), (0.10, 0.10, 0.11)),
    )
    """Of the case and the panel."""

    def blueprint(self) -> Blueprint:
        """The microwave, its front at -y, standing on z = 0 with its middle above the origin."""
        x, y, wall, foot = self.width / 2, self.depth / 2, 0.010, 0.008
        case, _ = self.colours
        front, split = -y + self.door, x - self.panel
        top = self.height
        inside = (0.45, 0.46, 0.47)
        walls = [
            slab((-x, front, foot), (x, y, foot + wall), case, corner=0.002),
            slab((-x, front, top - wall), (x, y, top), case, corner=0.002, edge=0.003),
            slab((-x, front, foot + wall), (-x + wall, y, top - wall), case, corner=0, edge=0),
            slab((-x + wall, y - wall, foot + wall), (split, y, top - wall), case, corner=0, edge=0),
            slab((split, front, foot + wall), (x, y, top - wall), case, corner=0, edge=0),
            slab((split, -y, foot), (x, front, top), case, corner=0.006, edge=0.002, axis="y"),
        ]
        feet = [
            slab((a - 0.010, b - 0.010, 0), (a + 0.010, b + 0.010, foot), _GLASS, corner=0.010)
            for a in (-x + 0.025, x - 0.025)
            for b in (front + 0.015, y - 0.025)
        ]
        middle = (-x + wall + split) / 2, (front + y - wall) / 2
        radius = 0.42 * min(split + x - wall, y - wall - front)
        plate = lathe([(radius - 0.004, foot + wall), (radius, foot + wall + 0.004)], (0.62, 0.72, 0.74), middle=middle)
        back = (-x + wall, y - wall - 0.0004, foot + wall), (split, y - wall, top - wall)
        return Blueprint(
            base=[*walls, *feet, detail(plate), detail(slab(*back, inside, corner=0, edge=0)), *self._panel(split)],
            base_mass=self.base_mass,
            articulated=self._door(split),
            articulated_mass=self.door_mass,
            hinge=Hinge((-x, front - 0.001, 0.0), (0.0, 0.0, -1.0), upper=1.9),
        )

    def _door(self, split: float) -> list[Solid]:
        x, y, bottom, top = self.width / 2, self.depth / 2, 0.010, self.height
        case, _ = self.colours
        right, near, front = split - 0.0015, -y + self.door - 0.001, -y
        bar = right - 0.018
        low, high = bottom + 0.20 * (top - bottom), bottom + 0.80 * (top - bottom)
        out = front - self.reach
        path = [(bar, front, low), (bar, out, low), (bar, out, high), (bar, front, high)]
        window = (-x + 0.018, bottom + 0.020), (bar - 0.018, top - 0.020)
        (left, sill), (side, head) = window
        frame = (left - 0.004, front - 0.0006, sill - 0.004), (side + 0.004, front, head + 0.004)
        pane = (left, front - 0.0012, sill), (side, front, head)
        return [
            slab((-x, front, bottom), (right, near, top), case, corner=0.006, edge=0.002, axis="y"),
            tube(path, self.bar, _STEEL),
            detail(slab(*frame, _STEEL, corner=0.008, edge=0, axis="y")),
            detail(slab(*pane, _GLASS, corner=0.006, edge=0, axis="y")),
            detail(slab((left, near, sill), (side, near + 0.0004, head), _GLASS, corner=0.006, edge=0, axis="y")),
        ]

    def _panel(self, split: float) -> list[Solid]:
        """A clock, three rows of buttons and a knob."""
        front, top, middle = -self.depth / 2, self.height, (split + self.width / 2) / 2
        _, panel = self.colours
        half = self.panel / 2 - 0.008
        low, high = (middle - half, front - 0.0006, 0.018), (middle + half, front, top - 0.008)
        found = [detail(slab(low, high, panel, corner=0.005, edge=0, axis="y"))]
        clock = top - 0.026
        inner = half - 0.004
        low, high = (middle - inner, front - 0.0012, clock - 0.010), (middle + inner, front, clock + 0.010)
        found.append(detail(slab(low, high, _GLASS, corner=0.002, edge=0, axis="y")))
        found += [digit.moved((middle, front - 0.0013, clock)) for digit in letters("12:30", 0.010, _GLOW)]
        pitch, button = (2 * half - 0.008) / 3, 0.0
        for row in range(3):
            button = clock - 0.022 - 0.013 * row
            for column in (-1, 0, 1):
                low = middle + column * pitch - 0.4 * pitch, front - 0.0016, button - 0.0045
                high = middle + column * pitch + 0.4 * pitch, front, button + 0.0045
                found.append(detail(slab(low, high, (0.55, 0.56, 0.58), corner=0, edge=0.0004)))
        place = (button - 0.006 + 0.018) / 2, middle
        radius = min(0.014, (button - 0.008 - 0.020) / 2)
        knob = lathe([(radius - 0.002, front - 0.008), (radius, front)], _STEEL, middle=place, axis="y")
        return [*found, detail(knob)]
