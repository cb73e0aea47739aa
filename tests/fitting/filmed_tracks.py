"""Films of machines of known truth as a tracker sees them: rests of some frames, flights between, noise of pixels."""

import math
from dataclasses import dataclass

import numpy as np

from tests.fitting.machines import ARM, HEIGHT, KAPPA, described, thrown
from tests.proofs.forge import Plain

# The part of paper-designed, on side 0 from the origin, and the vertex at the left end of each side.
VERTICES = np.array([0.0, 5.75, complex(0.040, math.sqrt(3.6**2 - 0.04**2))])
LEFT = np.array([0, 2, 1])


@dataclass
class Film:
    """Poses in each frame [in], which of them are rests, and the rests as they truly are.

    A place p of the part is at ``at + turn * p``; `rests` has (x of the centre of mass, side, left corner).
    """

    at: np.ndarray
    turn: np.ndarray
    resting: np.ndarray
    rests: list
    throws: list
    centre: complex

    def points(self, which=(0, 1, 2)):
        return self.at[:, None] + self.turn[:, None] * VERTICES[list(which)]


def filmed(
    draw, truth, throws=20, *, speed=0.002, landing=0.01, each=10, rest=(15, 40), flight=(8, 14), hidden=40
):
    """Film throw after throw; after `each` of them somebody takes the part and lays it elsewhere, out of sight."""
    plain = Plain(described(truth))
    sides = [abs(VERTICES[(k + 1) % 3] - VERTICES[k]) for k in LEFT]
    assert np.allclose(sides, plain.L)
    own = [(VERTICES[(k + 1) % 3] - VERTICES[k]).conjugate() / sides[i] for i, k in enumerate(LEFT)]
    centre = VERTICES[LEFT[2]] + complex(plain.a[2], plain.d[2]) / own[2]
    at, turn, resting, rests, pairs = [], [], [], [], []

    def lay(x, side, frames):
        rests.append((x, side, x - plain.a[side]))
        u = own[side]
        at.extend([complex(x - plain.a[side], truth[HEIGHT]) - u * VERTICES[LEFT[side]]] * frames)
        turn.extend([u] * frames)
        resting.extend([len(rests) - 1] * frames)

    def move(x, side, frames):
        """Move from the last pose towards the next one, above the arm, turning all the time."""
        u, start, begun = own[side], at[-1], turn[-1]
        end = complex(x - plain.a[side], truth[HEIGHT]) - u * VERTICES[LEFT[side]]
        turned = np.angle(u / begun) + 2 * math.pi
        for k in range(1, frames + 1):
            s = k / (frames + 1)
            now = begun * np.exp(1j * turned * s)
            mid = (1 - s) * (start + begun * centre) + s * (end + u * centre) + 1j * 16.0 * s * (1 - s)
            at.append(mid - now * centre)
            turn.append(now)
            resting.append(-1)

    for k in range(throws):
        if k % each == 0:
            side = int(draw.integers(3))
            x = float(draw.uniform(plain.a[side] + 2.0, ARM - 1.0))
            if k:
                at.extend([complex(np.nan, np.nan)] * hidden)
                turn.extend([1.0] * hidden)
                resting.extend([-2] * hidden)
            lay(x, side, int(draw.integers(*rest)))
        kappa = truth[KAPPA] / (1.0 + speed * draw.standard_normal()) ** 2
        after, end = thrown(plain, np.array([x]), np.array([side]), np.array([kappa]))
        x, side = float(after[0]) + landing * draw.standard_normal(), int(end[0])
        move(x, side, int(draw.integers(*flight)))
        pairs.append((len(rests) - 1, len(rests)))
        lay(x, side, int(draw.integers(*rest)))
    return Film(np.array(at), np.array(turn), np.array(resting), rests, pairs, centre)


@dataclass
class Camera:
    """Pixels a unit, turned by an angle [deg], the joint at a pixel; y points down."""

    scale: float = 12.0
    turned: float = 7.0
    joint: complex = complex(150.0, 600.0)
    tilted: float = 0.0  # the horizon's share: places shrink by it from one end of the arm to the other

    def __call__(self, places):
        shrunk = places * (1.0 / (1.0 + self.tilted * places.real / ARM))
        up = shrunk * np.exp(1j * math.radians(self.turned)) * self.scale
        return self.joint + up.conjugate()

    def pair(self, place):
        pixel = complex(self(np.array([complex(place)]))[0])
        return pixel.real, pixel.imag

    def options(self, reach=25.0):
        return {"origin": self.pair(0.0), "along": self.pair(reach), "length": f"{reach!r} in"}


def deeplabcut(points, likelihood=None, names=("P0", "P1", "P2"), frames=None):
    """Write the CSV file of DeepLabCut; points that are nan have no cells."""
    count, many = points.shape
    likelihood = np.full(points.shape, 0.99) if likelihood is None else likelihood
    frames = np.arange(count) if frames is None else frames
    heads = [["scorer", "bodyparts", "coords"]]
    heads += [["net", name, kind] for name in names for kind in ("x", "y", "likelihood")]
    lines = [",".join(head[k] for head in heads) for k in range(3)]
    for k in range(count):
        cells = [str(frames[k])]
        for j in range(many):
            z = points[k, j]
            cells += (
                [f"{z.real:.3f}", f"{z.imag:.3f}", f"{likelihood[k, j]:.3f}"]
                if np.isfinite(z)
                else ["", "", ""]
            )
        lines.append(",".join(cells))
    return "\n".join(lines) + "\n"


def long(points, names=("P0", "P1", "P2"), *, separator=",", unit="", time=None, angle=None, digits=3):
    """Write a table with a row for each point and frame."""
    unit = f" [{unit}]" if unit else ""
    heads = ["frame" if time is None else "time [s]", "id", f"x{unit}", f"y{unit}"]
    lines = [separator.join(heads + ([] if angle is None else ["angle [deg]"]))]
    for k in range(len(points)):
        for j, name in enumerate(names):
            z = points[k, j]
            if np.isfinite(z):
                first = str(k) if time is None else f"{k / time:.6f}"
                cells = [first, name, f"{z.real:.{digits}f}", f"{z.imag:.{digits}f}"]
                cells += [] if angle is None else [f"{angle[k]:.4f}"]
                cells = [cell.replace(".", ",") for cell in cells] if separator == ";" else cells
                lines.append(separator.join(cells))
    return "\n".join(lines) + "\n"


def noisy(draw, pixels, noise=0.3):
    return pixels + noise * (draw.standard_normal(pixels.shape) + 1j * draw.standard_normal(pixels.shape))
