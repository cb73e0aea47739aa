"""Scenes of which quantities are intervals, and throws at 50 digits by the impact angle, from the model's text."""

import copy
from fractions import Fraction
from itertools import product

from mpmath import mp

import limitsets as ls
from tests.inverse.exact import feet as plane_feet

MODELS = list(product(("exact", "small-angle", "small-angle-2"), ("signed", "energy")))

DESIGNED = {
    "throw.kappa": 25.3778518,
    "arm.surface_height": -0.2,
    "part.sides[0]": 5.75,
    "part.sides[1]": 3.6,
    "part.sides[2]": 6.75,
    "part.mass.center.along": 4.2255778,
    "part.mass.center.above": 0.7082490,
    "part.mass.radius_of_gyration": 1.25,
}

# each another one, so that none can stand for another
WIDTHS = {name: Fraction(1, 100 << k) for k, name in enumerate(DESIGNED)}


def written(name, model=None):
    tree = copy.deepcopy(ls.load(name).as_dict())
    return tree | ({"model": dict(zip(("flight", "flip"), model, strict=True))} if model else {})


def boxed(tree, widths):
    """A scene and its text, quantities of which are pairs of texts: their values -+ a width [in]."""
    wide = copy.deepcopy(tree)
    for name, width in widths.items():
        *path, last = name.replace("[", ".").replace("]", "").split(".")
        node, last = wide, int(last) if last.isdigit() else last
        for word in path:
            node = node[word]
        value = Fraction(node[last].split()[0])
        node[last] = [f"{float(value - width)!r} in", f"{float(value + width)!r} in"]
    return ls.load(tree), wide


def feet(values):
    """(a, d, L) of every side at 50 digits."""
    return [(*foot, values[f"part.sides[{k}]"]) for k, foot in enumerate(plane_feet(values))]


def by_hand(model, part, shift, values, p):
    """Where a throw with the angle p starts, jogs and flips to, and what decides: from the model's text."""
    (a, d, _), kappa, h = part, values["throw.kappa"], values["arm.surface_height"]
    rho2 = values["part.mass.radius_of_gyration"] ** 2
    flight, flip = model
    inertia = rho2 + a**2 + d**2
    if flight == "exact":
        x = (a * mp.sin(p) - d * (1 - mp.cos(p)) + kappa / 2 * p**2) / p
        right, above = a * mp.cos(p) - d * mp.sin(p), a * mp.sin(p) + d * mp.cos(p)
        omega = (rho2 + right * (x - kappa * p) + above * (h + d)) / inertia
        jog = x - (h + d) * p - right + a
        potential, past = kappa * (mp.hypot(a, d) - above), right < 0
    else:
        x = a + p * (kappa - (d if flight == "small-angle-2" else 0)) / 2
        omega = (rho2 - a * x + 2 * a**2 + d**2 + d * h) / inertia
        jog = x - h * p
        potential, past = kappa * (mp.hypot(a, d) - d) - 2 * a * (x - a), False
    kinetic = inertia * omega**2 / 2
    turned = mp.sign(omega) * kinetic if flip == "signed" else kinetic
    return x, jog, jog - shift, turned - (-potential if past else potential)
