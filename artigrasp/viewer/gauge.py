"""The hinge's gauge, the phase and the metrics as HTML for the panel."""

import html
import math
from collections.abc import Mapping

ACCENT, TARGET, TRACK, FAINT = "#2f7fc1", "#34b27b", "#dde2e8", "#7b8794"
RADIUS, WIDTH = 52.0, 9.0
"""Of the gauge's arc and its line [px]."""
WHOLE = math.radians(180.0)
"""Hinge angle that is half a circle on the gauge, one to one [rad]."""


def status_html(*, title: str, phase: str, time: float, angle: float, target: float | None, note: str = "") -> str:
    """What is shown, how far the hinge is open, and what goes on.

    Args:
        title: Of the subject.
        phase: What the hands are doing.
        time: Of the sample that is shown [s].
        angle: Of the hinge [rad].
        target: Angle to reach [rad], None if there is none.
        note: What must be known; empty if nothing.
    """
    degrees = round(math.degrees(angle))
    goal = "" if target is None else f" <span style='color:{FAINT}'>of</span> {math.degrees(target):.0f}°"
    warning = f"<div style='color:#c2410c;margin-top:6px'>{html.escape(note)}</div>" if note else ""
    return (
        f"<div style='padding:2px 10px 4px;font-size:13px;line-height:1.35'>"
        f"<div style='font-weight:600;overflow-wrap:anywhere'>{html.escape(title)}</div>"
        f"<div style='display:flex;align-items:center;gap:14px;margin-top:4px'>{_gauge(angle, target)}"
        f"<div><div style='font-size:22px;font-weight:600;font-variant-numeric:tabular-nums'>"
        f"<span class='hinge-angle'>{degrees}°</span><span style='font-size:13px;font-weight:400'>{goal}</span>"
        f"</div><div style='display:inline-block;margin-top:4px;padding:1px 9px;border-radius:9px;"
        f"background:{ACCENT}18;color:{ACCENT};font-weight:600' class='phase'>{html.escape(phase) or '–'}</div>"
        f"<div style='color:{FAINT};margin-top:3px;font-variant-numeric:tabular-nums' class='sample-time'>"
        f"{time:.2f} s</div></div></div>{warning}</div>"
    )


def metrics_html(metrics: Mapping[str, float]) -> str:
    """A table of metrics."""
    if not metrics:
        return f"<div style='padding:4px 10px;color:{FAINT};font-size:12px'>no metrics yet</div>"
    rows = "".join(
        f"<tr><td style='color:{FAINT};padding:1px 10px 1px 10px'>{html.escape(name.replace('_', ' '))}</td>"
        f"<td style='text-align:right;font-variant-numeric:tabular-nums'>{value:.3f}</td></tr>"
        for name, value in metrics.items()
    )
    return f"<table style='font-size:12px;line-height:1.5;border-collapse:collapse'>{rows}</table>"


def scale_html(colours: list[str], largest: float) -> str:
    """The colours of contact forces from none to the largest [N], in equal steps."""
    share = 100 / len(colours)
    steps = ",".join(
        f"{colour} {share * index:.1f}% {share * (index + 1):.1f}%" for index, colour in enumerate(colours)
    )
    return (
        f"<div style='padding:2px 10px 6px;font-size:11px;color:{FAINT}'>"
        f"<div style='height:7px;border-radius:4px;background:linear-gradient(90deg,{steps})'></div>"
        f"<div style='display:flex;justify-content:space-between'><span>contact force 0</span>"
        f"<span>{largest:.0f} N and more</span></div></div>"
    )


def _gauge(angle: float, target: float | None) -> str:
    """A half circle that opens as the hinge does, with a tick at the target."""
    side, height = 2 * RADIUS + WIDTH + 4, RADIUS + WIDTH + 4
    tick = ""
    if target is not None:
        inner, outer = _point(target, RADIUS - WIDTH), _point(target, RADIUS + WIDTH / 2 + 1)
        tick = f"<path d='M{inner} L{outer}' stroke='{TARGET}' stroke-width='3' stroke-linecap='round'/>"
    box = f"{-side / 2:.1f} {2 - height:.1f} {side:.1f} {height + WIDTH / 2:.1f}"
    return (
        f"<svg width='{side:.0f}' height='{height + WIDTH / 2:.0f}' viewBox='{box}'>"
        f"<g fill='none' stroke-width='{WIDTH}' stroke-linecap='round'>"
        f"<path d='{_arc(WHOLE)}' stroke='{TRACK}'/><path d='{_arc(angle)}' stroke='{ACCENT}'/></g>{tick}</svg>"
    )


def _arc(angle: float) -> str:
    clipped = min(max(angle, 0.001), WHOLE)
    return f"M{_point(0.0)} A{RADIUS} {RADIUS} 0 0 0 {_point(clipped)}"


def _point(angle: float, radius: float = RADIUS) -> str:
    clipped = min(max(angle, 0.0), WHOLE)
    return f"{radius * math.cos(clipped):.2f},{-radius * math.sin(clipped):.2f}"
