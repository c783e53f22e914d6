"""A notebook bound by a wire: lined pages between two covers, of which the upper one turns all the way round."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from artigrasp.assets.object_model import Colour
from artigrasp.assets.open_set.hinged import Blueprint, Hinge
from artigrasp.assets.open_set.parameters import chosen, ranged
from artigrasp.assets.open_set.solids import Solid, detail, slab, tube
from artigrasp.assets.open_set.strokes import letters

_ARCTIC = "around ARCTIC's notebook: 0.23 by 0.16 by 0.05 m, 0.77 and 0.10 kg"
_PAPER, _INK, _MARGIN, _WIRE = (0.88, 0.86, 0.78), (0.35, 0.50, 0.72), (0.80, 0.25, 0.25), (0.10, 0.10, 0.11)


@dataclass(frozen=True)
class Notebook:
    """Sizes, masses and colours of a notebook."""

    width: float = ranged(0.160, 0.140, 0.185, "m", "A5 to B5; ARCTIC's: 0.16")
    length: float = ranged(0.220, 0.200, 0.250, "m", "A5 to B5; ARCTIC's: 0.23")
    pages: float = ranged(0.040, 0.034, 0.046, "m", "thickness of the block; ARCTIC's is 0.05 high in all")
    cover: float = ranged(0.004, 0.003, 0.005, "m", "thickness of each cover: bookbinder's board")
    lip: float = ranged(0.016, 0.014, 0.020, "m", "how far the upper cover reaches beyond the pages")
    base_mass: float = ranged(0.60, 0.45, 0.80, "kg", _ARCTIC)
    cover_mass: float = ranged(0.10, 0.07, 0.14, "kg", _ARCTIC)
    colours: tuple[Colour, Colour] = chosen(
        ((0.04, 0.19, 0.30), (0.92, 0.86, 0.70)),
        ((0.60, 0.12, 0.07), (0.93, 0.88, 0.74)),
        ((0.08, 0.27, 0.15), (0.90, 0.84, 0.66)),
        ((0.80, 0.47, 0.07), (0.10, 0.09, 0.09)),
    )
    """Of the covers and the label."""

    def blueprint(self) -> Blueprint:
        """The notebook, its spine at -x, lying on z = 0 with its middle above the origin."""
        x, y, thin = self.width / 2, self.length / 2, self.cover
        paper = thin + self.pages
        top = paper + 0.001 + thin
        spine, cover = -x + 0.002, self.colours[0]
        # Halfway up: turned over, the upper cover lies on the table.
        axis = (-x - 0.004, 0.0, top / 2)
        edge = x + self.lip
        return Blueprint(
            base=[
                slab((spine, -y, 0), (x, y, thin), cover, corner=0.004, edge=0.0008),
                slab((spine, -y + 0.003, thin), (x - 0.002, y - 0.003, paper), _PAPER, corner=0.003, edge=0),
                *self._wires(axis[0], top / 2),
                *self._lines(paper),
            ],
            base_mass=self.base_mass,
            articulated=[
                slab((spine, -y, paper + 0.001), (edge, y, top), cover, corner=0.006, edge=0.0012),
                *self._label(top),
            ],
            articulated_mass=self.cover_mass,
            hinge=Hinge(axis, (0.0, -1.0, 0.0), upper=float(np.pi)),
        )

    def _wires(self, middle: float, height: float) -> list[Solid]:
        """Rings around the hinge."""
        radius = height - 0.0018
        angles = 2 * np.pi * np.arange(12) / 12
        ring = np.stack([middle + radius * np.cos(angles), np.zeros(12), height + radius * np.sin(angles)], axis=1)
        places = np.linspace(-0.43, 0.43, 12) * self.length
        wire = detail(tube(ring, 0.0014, _WIRE, closed=True, sides=5))
        return [wire.moved((0, y, 0)) for y in places]

    def _lines(self, height: float) -> list[Solid]:
        """Lines and a margin on the first page."""
        x, y = self.width / 2, self.length / 2
        left = -x + 0.034
        found = []
        for at in np.arange(-y + 0.016, y - 0.024, 0.009):
            line = (-x + 0.012, at - 0.0003, height), (x - 0.008, at + 0.0003, height + 0.0002)
            found.append(detail(slab(*line, _INK, corner=0, edge=0)))
        margin = (left - 0.0004, -y + 0.006, height), (left + 0.0004, y - 0.006, height + 0.0003)
        return [*found, detail(slab(*margin, _MARGIN, corner=0, edge=0))]

    def _label(self, top: float) -> list[Solid]:
        """A label with a word, and a stripe along the spine."""
        x, y = self.width / 2, self.length / 2
        cover, paper = self.colours
        dark: Colour = (0.35 * cover[0], 0.35 * cover[1], 0.35 * cover[2])
        low, high = (-0.25 * self.width, 0.18 * y, top), (0.33 * self.width, 0.62 * y, top + 0.0004)
        word = letters("NOTES", 0.10 * self.width, dark)
        from_above = [_lying(letter).moved((0.04 * self.width, 0.44 * y, top + 0.0004)) for letter in word]
        stripe = (-x + 0.018, -y + 0.0015, top), (-x + 0.024, y - 0.0015, top + 0.0003)
        rule = (-0.2 * self.width, 0.28 * y, top), (0.28 * self.width, 0.28 * y + 0.001, top + 0.0006)
        return [
            detail(slab(*low_high, colour, corner=corner, edge=0))
            for low_high, colour, corner in (((low, high), paper, 0.004), (stripe, paper, 0), (rule, dark, 0))
        ] + from_above


def _lying(solid: Solid) -> Solid:
    """A solid that was to be read from -y, to be read from above."""
    return solid.moved(rotation=Rotation.from_euler("x", -90, degrees=True))
