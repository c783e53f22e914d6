"""A wooden box with two leather straps; its lid reaches beyond the front as a lip."""

from dataclasses import dataclass

from artigrasp.assets.object_model import Colour
from artigrasp.assets.open_set.hinged import Blueprint, Hinge
from artigrasp.assets.open_set.parameters import chosen, ranged
from artigrasp.assets.open_set.solids import detail, slab

_ARCTIC = "around ARCTIC's box: 0.34 by 0.24 by 0.23 m, 0.96 and 0.13 kg"


@dataclass(frozen=True)
class Box:
    """Sizes, masses and colours of a box."""

    width: float = ranged(0.28, 0.22, 0.34, "m", _ARCTIC)
    depth: float = ranged(0.20, 0.17, 0.24, "m", _ARCTIC)
    height: float = ranged(
        0.15, 0.11, 0.19, "m", "that of shoe and storage boxes, lower than ARCTIC's: hands reach over"
    )
    wall: float = ranged(0.008, 0.006, 0.010, "m", "plywood")
    lid: float = ranged(0.014, 0.011, 0.018, "m", "plywood, doubled")
    lip: float = ranged(0.020, 0.016, 0.026, "m", "what the last joint of a finger takes hold of")
    base_mass: float = ranged(0.90, 0.65, 1.20, "kg", _ARCTIC)
    lid_mass: float = ranged(0.20, 0.13, 0.28, "kg", _ARCTIC)
    colours: tuple[Colour, Colour, Colour] = chosen(
        ((0.46, 0.25, 0.11), (0.60, 0.36, 0.17), (0.10, 0.045, 0.02)),
        ((0.05, 0.16, 0.22), (0.08, 0.25, 0.32), (0.55, 0.30, 0.10)),
        ((0.36, 0.05, 0.05), (0.52, 0.09, 0.08), (0.72, 0.52, 0.25)),
        ((0.62, 0.55, 0.44), (0.74, 0.68, 0.57), (0.20, 0.10, 0.05)),
    )
    """Of the walls, the lid and the straps."""

    def blueprint(self) -> Blueprint:
        """The box, its front at -y, standing on z = 0 with its middle above the origin."""
        x, y, wall = self.width / 2, self.depth / 2, self.wall
        floor, top = 0.008, self.height - self.lid - 0.001
        walls, planks, leather = self.colours
        dark: Colour = (0.4 * walls[0], 0.4 * walls[1], 0.4 * walls[2])
        brass = (0.70, 0.48, 0.16)
        sides = [
            slab((-x + wall, -y + wall, floor), (x - wall, y - wall, floor + wall), walls, corner=0, edge=0),
            slab((-x, -y, floor), (x, -y + wall, top), walls, corner=0.002),
            slab((-x, y - wall, floor), (x, y, top), walls, corner=0.002),
            slab((-x, -y + wall, floor), (-x + wall, y - wall, top), walls, corner=0),
            slab((x - wall, -y + wall, floor), (x, y - wall, top), walls, corner=0),
        ]
        feet = [
            slab((a - 0.014, b - 0.014, 0), (a + 0.014, b + 0.014, floor + 0.001), dark, corner=0.014)
            for a in (-x + 0.022, x - 0.022)
            for b in (-y + 0.022, y - 0.022)
        ]
        posts = [
            detail(slab((a - 0.006, b - 0.006, floor), (a + 0.006, b + 0.006, top), dark, corner=0, edge=0.001))
            for a in (-x + 0.0045, x - 0.0045)
            for b in (-y + 0.0045, y - 0.0045)
        ]
        plate, card = 0.42 * top, -y - 0.0018
        label = [
            detail(slab((-0.035, -y - 0.0012, plate), (0.035, -y, plate + 0.026), brass, axis="y")),
            detail(slab((-0.031, card, plate + 0.004), (0.031, -y, plate + 0.022), planks, corner=0, edge=0, axis="y")),
        ]
        front = -y - self.lip
        down, over = [], []
        for a in (-0.55 * x, 0.55 * x):
            left, right = a - 0.011, a + 0.011
            for outside, inside in ((-y - 0.0015, -y), (y + 0.0015, y)):
                ends = (left, min(outside, inside), floor + 0.002), (right, max(outside, inside), top)
                down.append(detail(slab(*ends, leather, corner=0, edge=0.0005)))
            ends = (left, front - 0.0015, self.height), (right, y, self.height + 0.0015)
            over.append(detail(slab(*ends, leather, corner=0, edge=0.0005)))
            ends = (left, front - 0.0015, top + 0.002), (right, front, self.height)
            over.append(detail(slab(*ends, leather, corner=0, edge=0.0005)))
            ends = (left + 0.003, front - 0.003, top + 0.004), (right - 0.003, front, self.height - 0.003)
            over.append(detail(slab(*ends, brass, edge=0.001, axis="y")))
        lid = slab((-x - 0.006, front, top + 0.001), (x + 0.006, y, self.height), planks, corner=0.006, edge=0.003)
        return Blueprint(
            base=[*sides, *feet, *posts, *label, *down],
            base_mass=self.base_mass,
            articulated=[lid, *over],
            articulated_mass=self.lid_mass,
            hinge=Hinge((0.0, y, top + 0.001), (-1.0, 0.0, 0.0), upper=2.2),
        )
