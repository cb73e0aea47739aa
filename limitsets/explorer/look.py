"""How the page looks: one column on a phone, two beside each other where there is room; focus can be seen."""

from __future__ import annotations

# Panel's own page, told that a phone is narrow; `base` is what Panel gives.
PAGE = """{% extends base %}{% block preamble %}
<meta name="viewport" content="width=device-width, initial-scale=1">
<style>body { padding: 0 10px 10px !important; box-sizing: border-box; color: #222; }</style>
{% endblock %}"""


def swatch(face: str, hatch: str = " ") -> str:
    """Draw a piece of a colour and, in lines or dots, its hatch, as the pictures have them (HTML)."""
    marks = ", ".join(
        "radial-gradient(#222 30%, transparent 35%) 0 0 / 5px 5px"
        if angle is None
        else f"repeating-linear-gradient({angle}deg, transparent 0 3px, #222 3px 4px)"
        for angle in TURNED.get(hatch, ())
    )
    return f'<span class="swatch" style="background: {marks}{", " if marks else ""}{face}"></span>'


LINES: dict[str, tuple[int | None, ...]] = {
    "/": (135,),
    "\\": (45,),
    "x": (45, 135),
    "|": (90,),
    "-": (0,),
    "+": (0, 90),
}
TURNED = {**LINES, "*": (0, 90), "o": (None,), ".": (None,)}
"""Angles across the lines of each hatch, in the words of CSS; None for dots."""

SAID = """
:host, div { font-family: system-ui, -apple-system, "Segoe UI", "DejaVu Sans", sans-serif; color: #222; }
h1 { font-size: 1.25rem; margin: 0.2rem 0; }
h2 { font-size: 1rem; margin: 0.5rem 0 0.2rem; }
p { margin: 0.2rem 0; font-size: 0.9rem; line-height: 1.35; }
.wrong { color: #8a1c00; background: #fdeee6; border-left: 4px solid #8a1c00; padding: 0.4rem 0.6rem; }
.wrong { overflow-wrap: anywhere; }
.how { color: #555; font-size: 0.8rem; }
.said { border-collapse: collapse; font-size: 0.85rem; width: 100%; }
.said th { text-align: left; font-weight: 600; vertical-align: top; padding: 0.2rem 0.6rem 0.2rem 0; width: 30%; }
.said td { vertical-align: top; padding: 0.2rem 0; overflow-wrap: anywhere; }
.swatch { display: inline-block; width: 1.1em; height: 0.8em; border: 1px solid #444; margin-right: 0.3em; }
"""

SLIDER = """
input:focus-visible, button:focus-visible, select:focus-visible, a:focus-visible, canvas:focus-visible,
textarea:focus-visible { outline: 3px solid #0072B2; outline-offset: 1px; }
label { font-size: 0.85rem; font-family: system-ui, -apple-system, "Segoe UI", "DejaVu Sans", sans-serif; }
input[type=range] { display: block; width: 100%; height: 24px; margin: 0; accent-color: #0072B2; touch-action: pan-y; }
"""
