"""`limitsets film`: throws out of the tables of trackers, against films of known truth."""

import math
from collections import Counter
from itertools import pairwise

import numpy as np
import pytest
from limitsets.fitting import read_throws, throws_of_film
from scipy.stats import chi2

import limitsets as ls
from limitsets.base.errors import DataError, LimitsetsError
from tests.cli.command import documented, json_of, prints, refusal
from tests.fitting.filmed_tracks import Camera, deeplabcut, filmed, long, noisy
from tests.fitting.machines import ABOVE, ALONG, HEIGHT, KAPPA, RADIUS, machine

SCENE = "paper-designed"
NAN = complex(math.nan, math.nan)
MARKER = (1.5 + 0.8j, 20.0)  # in, deg


@pytest.fixture(scope="module")
def once():
    """A film of 20 throws, its camera, and what this shows of the vertices."""
    draw = np.random.default_rng(7)
    film, camera = filmed(draw, machine(draw), 20), Camera()
    return film, camera, noisy(draw, camera(film.points()))


@pytest.fixture
def truth(once):
    """All this, and random numbers, the same in each test."""
    return *once, np.random.default_rng(11)


@pytest.fixture
def table(tmp_path):
    def written(text):
        path = tmp_path / "tracks.csv"
        path.write_text(text, encoding="utf-8", newline="")
        return path

    return written


def read(path, camera, **options):
    return throws_of_film(SCENE, path, **(camera.options() | options))


def rest_of(film, rest):
    """Which of the true rests one that was seen is; no frame is of another, or of a flight."""
    (which,) = {int(each) for each in film.resting[rest.frames]}
    return which


def require_true(film, answer, tmp_path, *, least=20, centre=False):
    """Throws are true ones, on true sides, at true places within the stated errors; the fit takes the file."""
    pairs = [(rest_of(film, one), rest_of(film, two)) for one, two, _ in answer.throws]
    assert len(set(pairs)) == len(pairs) >= least
    assert set(pairs) <= set(film.throws)
    used = {rest_of(film, each): each for pair in answer.throws for each in pair[:2]}
    assert all(film.rests[k][1] == rest.side for k, rest in used.items())
    misses = [(rest.x - film.rests[k][0 if centre else 2]) / rest.error for k, rest in used.items()]
    # between the quantiles of 0.1 % and 99.9 %
    assert chi2.ppf(0.001, len(misses)) < np.sum(np.square(misses)) < chi2.ppf(0.999, len(misses))
    throws = read_throws(answer.save(tmp_path / "throws.csv"), ls.load(SCENE))
    assert len(throws) == len(pairs)
    assert throws.corner is not centre
    # rows of one run follow each other, and share the reading between them
    follow = [one[1] == two[0] for one, two in pairwise(pairs)]
    assert throws.shared.tolist() == throws.follows.tolist() == [False, *follow]


# ----------------------------------------------------------------
# Each form of a table shows the same throws.


def marker_in(film, camera, draw):
    """Pixels and angle of a marker on the part, with noise."""
    spot, turned = MARKER
    at = film.at + film.turn * spot
    axis = film.turn * np.exp(1j * math.radians(turned))
    here, there = camera(at), camera(at + axis)
    angle = np.degrees(np.angle(there - here)) + 0.1 * draw.standard_normal(at.size)
    return noisy(draw, here)[:, None], angle


def in_table(form, truth):
    """The text of a table and the options with which it is read."""
    film, camera, pixels, draw = truth
    if form == "lengths":
        places = 25.4 * noisy(draw, film.points(), 0.025)
        return long(places, unit="mm"), {"origin": None, "along": None, "length": None, "y_up": True}
    if form == "marker":
        pixels, angle = marker_in(film, camera, draw)
        option = (MARKER[0].real, f"{25.4 * MARKER[0].imag} mm", f"{MARKER[1]} deg")
        return long(pixels, ("17",), angle=angle), {"marker": option}
    if form == "corners":
        tilted = Camera(tilted=0.2)
        places = [0j, 28.0 + 0j, 28.0 + 9j, 10j]
        corners = [(tilted.pair(place), (f"{place.real} in", place.imag)) for place in places]
        shown = noisy(draw, tilted(film.points()))
        return deeplabcut(shown), {"origin": None, "along": None, "length": None, "corners": corners}
    if form == "mirrored":
        behind = noisy(draw, 800.0 - camera(film.points()).conj())
        origin, along = (800.0 - complex(*camera.pair(x)).conjugate() for x in (0.0, 25.0))
        options = {"origin": (origin.real, origin.imag), "along": (along.real, along.imag), "mirrored": True}
        return deeplabcut(behind), options
    if form == "two points":
        return deeplabcut(pixels[:, :2], names=("P0", "P1")), {}
    return {
        "DeepLabCut": lambda: deeplabcut(pixels),
        "DeepLabCut, semicolons": lambda: deeplabcut(pixels).replace(",", ";").replace(".", ","),
        "long": lambda: "\ufeff# by a tracker\n\n" + long(pixels),
        "long, decimal commas": lambda: long(pixels, separator=";", unit="px"),
        "long, times": lambda: long(pixels, separator="\t", time=59.94),
    }[form](), {}


FORMS = (
    "DeepLabCut",
    "DeepLabCut, semicolons",
    "long",
    "long, decimal commas",
    "long, times",
    "lengths",
    "marker",
    "corners",
    "mirrored",
    "two points",
)


@pytest.mark.parametrize("form", FORMS)
def test_each_form_of_a_table_shows_the_throws_of_the_film(form, truth, table, tmp_path):
    text, options = in_table(form, truth)
    answer = read(table(text), truth[1], **options)
    require_true(truth[0], answer, tmp_path)
    assert answer.frames == len(truth[0].at)
    if form != "marker":
        assert answer.seen.noise == pytest.approx(0.025, rel=0.1)
        assert abs(answer.poses.scale - 1.0) < 5.0 * max(answer.poses.scale_error, 1e-4)


def test_a_mark_at_the_centre_of_mass_is_read_where_it_is(truth, table, tmp_path):
    film, camera, pixels, draw = truth
    marks = noisy(draw, camera(film.at + film.turn * film.centre))
    path = table(deeplabcut(np.column_stack([pixels, marks]), names=("P0", "P1", "P2", "com")))
    require_true(film, read(path, camera, centre=True), tmp_path, centre=True)


# ----------------------------------------------------------------
# Tracks have gaps, jumps, and points taken for each other.


def spoilt(kind, film, pixels, draw):
    pixels, likelihood = pixels.copy(), np.full(pixels.shape, 0.99)
    some = draw.random(len(pixels)) < 0.05
    if kind == "frames dropped":
        pixels[draw.random(len(pixels)) < 0.1] = NAN
    elif kind == "two points exchanged":
        pixels[some] = pixels[some][:, [1, 0, 2]]
    elif kind == "all points handed on":
        pixels[some] = pixels[some][:, [1, 2, 0]]
    elif kind == "likelihood":
        unsure = draw.random(pixels.shape) < 0.1
        pixels[unsure], likelihood[unsure] = 5.0 + 5.0j, 0.4
    elif kind == "jumps":
        pixels[some] += 60.0
    elif kind == "flights lost":
        pixels[film.resting < 0] = NAN
    return deeplabcut(pixels, likelihood)


REASONS = {
    "frames dropped": "too few points seen",
    "two points exchanged": "points exchanged or far off",
    "all points handed on": "points exchanged or far off",
    "likelihood": "too few points seen",
    "jumps": "a jump of the track",
    "flights lost": "too few points seen",
}


@pytest.mark.parametrize("kind", REASONS)
def test_what_is_wrong_in_some_frames_is_left_out(kind, truth, table, tmp_path):
    film, camera, pixels, draw = truth
    answer = read(table(spoilt(kind, film, pixels, draw)), camera)
    assert REASONS[kind] in answer.left_out
    # a throw is lost where a short rest has hardly three frames in a row
    require_true(film, answer, tmp_path, least=16)


def test_readings_that_stay_for_a_rest_are_in_the_errors(truth, table, tmp_path):
    """What a tracker misses in one picture it misses in all of a rest; and noise may be smooth in time."""
    film, camera, _, draw = truth
    own = 0.5 * (draw.standard_normal((len(film.rests), 3)) + 1j * draw.standard_normal((len(film.rests), 3)))
    pixels = camera(film.points())
    resting = film.resting >= 0
    pixels[resting] += own[film.resting[resting]]
    answer = read(table(deeplabcut(noisy(draw, pixels, 0.2))), camera)
    require_true(film, answer, tmp_path)
    smooth = noisy(draw, np.zeros(pixels.shape), 0.3)
    for k in range(1, len(smooth)):
        smooth[k] = 0.8 * smooth[k - 1] + 0.6 * smooth[k]
    answer = read(table(deeplabcut(camera(film.points()) + smooth)), camera)
    require_true(film, answer, tmp_path)


def test_a_part_that_is_held_or_lies_beside_the_arm_is_no_rest(truth, table):
    film, camera, _, draw = truth
    places = film.points()
    held, fallen = (np.flatnonzero(film.resting == k) for k in (3, 8))
    places[held] = places[held].mean() + (places[held] - places[held].mean()) * np.exp(0.3j)
    places[fallen] -= 6.0j
    answer = read(table(deeplabcut(noisy(draw, camera(places)))), camera)
    assert set(answer.left_out) == {"too few points seen", "on no side", "not on the arm"}
    pairs = {(rest_of(film, one), rest_of(film, two)) for one, two, _ in answer.throws}
    assert pairs == {pair for pair in film.throws if not {3, 8} & set(pair)}
    assert len({run for *_, run in answer.throws}) == 4


def test_the_period_of_the_arm_says_which_rests_follow_each_other(table):
    draw = np.random.default_rng(2)
    film = filmed(draw, machine(draw), 20, each=20, rest=(40, 41), flight=(10, 11))
    camera = Camera()
    pixels = noisy(draw, camera(film.points()))
    pixels[film.resting < 0] = NAN
    pixels[film.resting == 6] = NAN
    answer = read(table(deeplabcut(pixels)), camera, period=50.0)
    pairs = [(rest_of(film, one), rest_of(film, two)) for one, two, _ in answer.throws]
    assert pairs == [pair for pair in film.throws if 6 not in pair]
    assert [run for *_, run in answer.throws] == ["tracks 1"] * 5 + ["tracks 2"] * 13
    # without it, a gap that is longer than others is no throw either
    assert len(read(table(deeplabcut(pixels)), camera).throws) == 18


def test_what_is_not_quite_right_is_said(truth, table):
    film, camera, pixels, _ = truth
    marks = np.column_stack([pixels[film.resting < 5][:, :3]] * 2)
    path = table(deeplabcut(marks, names=("P0", "P1", "P2", "nose", "arm", "lamp")))
    said = read(path, camera, length="25.8 in").lines()
    assert len(said) == 4
    assert said[1].startswith("careful: the part is 1.03")
    assert said[2] == "not read: nose, arm, lamp"
    assert said[3].startswith("a fit takes 8 throws or more")


# ----------------------------------------------------------------
# One line for whatever is wrong, with its remedy.


def of(text):
    return lambda truth: (text, {})


def film_with(**options):
    return lambda truth: (deeplabcut(truth[2]), options)


def changed(how):
    return lambda truth: (deeplabcut(how(truth)), {})


def reversed_line(truth):
    options = truth[1].options()
    return deeplabcut(truth[2]), {"origin": options["along"], "along": options["origin"]}


def higher(truth):
    x, y = truth[1].pair(0.0)
    u, v = truth[1].pair(25.0)
    return deeplabcut(truth[2]), {"origin": (x, y - 20.0), "along": (u, v - 20.0)}


def other_part(truth):
    film, camera, *_ = truth
    body = np.array([0.0, 4.0, 4.0 + 4.0j])
    return deeplabcut(camera(film.at[:, None] + film.turn[:, None] * body)), {}


def tilted(truth, points=3):
    film, _, _, draw = truth
    camera = Camera(tilted=0.3)
    shown = noisy(draw, camera(film.points())[:, :points])
    return deeplabcut(shown, names=("P0", "P1", "P2")[:points]), camera.options(reach=14.0)


LONG = "frame,id,x,y\n0,P0,1,2\n0,P1,4,5\n"
WRONG = {
    "no file": (of(None), "could not be opened: No such file"),
    "empty": (of("\n# nothing\n"), "the file is 'empty'"),
    "columns": (of("t;name;u;v\n1;P0;2;3\n"), "the column is 'frame missing'"),
    "no y": (of("frame,id,x\n1,P0,2\n"), "the column is 'y missing'"),
    "unit": (of(LONG.replace("x,y", "x [km],y [km]")), "the unit is 'km of x, km of y'"),
    "two units": (of(LONG.replace("x,y", "x [mm],y [cm]")), "the same for both"),
    "angle without unit": (of("frame,id,x,y,angle\n0,17,1,2,3\n"), 'write "angle [deg]"'),
    "names": (of(LONG.replace("P", "corner")), "rename them in column id"),
    "names in DeepLabCut": (of("scorer,a,a,a\nbodyparts,n,n,n\ncoords,x,y,likelihood\n"), "is 'n'"),
    "several animals": (of("scorer,a\nindividuals,one\nbodyparts,P0\ncoords,x\n"), "of one part"),
    "no x in DeepLabCut": (of("scorer,a,a\nbodyparts,P0,P0\ncoords,y,likelihood\n0,1,1\n"), "'P0 x missing'"),
    "text": (of(LONG.replace("4,5", "4,far")), "row 3, column y of P1: the number is 'far'"),
    "decimal commas": (
        of(LONG.replace("0,P1,4,5", '0,P1,"4,1",5')),
        "row 3, column x of P1: the number is '4,1'",
    ),
    "decimal commas everywhere": (of(LONG.replace("4,5", "4,2,5,1")), "row 3: the number of cells is 6"),
    "a column twice": (of(LONG.replace("x,y", "x,y,X")), "the column is 'x'"),
    "a huge number": (of(LONG.replace("4,5", "4,1e300")), "row 3, column y of P1: the number is '1e300'"),
    "half a frame": (of(LONG.replace("0,P1", "0.5,P1")), "row 3, column frame"),
    "no frame": (of(LONG.replace("0,P1", ",P1")), "row 3, column frame"),
    "twice": (of(LONG + "0,P1,4,5\n"), "row 4: the point is 'P1 twice in frame 0'"),
    "frames": (of(LONG + "99999999,P1,4,5\n"), "number the frames from 0"),
    "a point too many": (of(LONG.replace("P1", "P3")), "P0 to P2"),
    "one point": (of(LONG.replace("P1", "com")), "the centre of mass alone shows no side"),
    "short": (lambda truth: (deeplabcut(truth[2][:5]), {}), "the film is '5 frames'"),
    "no scale": (film_with(length=None), "in pixels is 'missing'"),
    "no origin": (film_with(origin=None), "in pixels is 'missing'"),
    "a point of the line": (film_with(along=Camera().pair(0.0)), "along is 'the origin itself'"),
    "length": (film_with(length="25 kg"), "this length is '25 kg'"),
    "length 0": (film_with(length="0 mm"), "the length from origin to along is '0 mm'"),
    "two scales": (film_with(corners=[((0, 0), (0, 0))] * 4), "the scale is 'corners and a length'"),
    "three corners": (film_with(corners=[((0, 0), (0, 0))] * 3, length=None), "the number of corners is 3"),
    "one corner": (film_with(corners=[((0, 0), (0, 0))] * 4, length=None), "'three on a line'"),
    "unit and length": (of(LONG.replace("x,y", "x [mm],y [mm]")), "the scale is 'a unit and a length'"),
    "scale off by 10 %": (film_with(length="27.5 in"), "the size of the part in the film is '1.1 times'"),
    "origin": (higher, "the origin or the arm's line is '1.7"),
    "reversed line": (reversed_line, "the arm's line is 'turned by"),
    "y up": (film_with(y_up=True), "the order of the points is 'that of a mirror'"),
    "from behind": (film_with(mirrored=True), "the order of the points is 'that of a mirror'"),
    "another part": (other_part, "the shape of the points is"),
    "names exchanged": (changed(lambda truth: truth[2][:, [1, 2, 0]]), "the shape of the points is"),
    "noise": (changed(lambda truth: noisy(truth[3], truth[2], 5.0)), "the noise of the points is"),
    "an angle": (tilted, "(perspective)"),
    "an angle, two points": (lambda truth: tilted(truth, 2), "(perspective)"),
    "one rest": (
        changed(lambda truth: truth[2][truth[0].resting == 0]),
        "the rests of the film is '1 of use'",
    ),
    "all flights": (
        changed(lambda truth: truth[2][truth[0].resting == -1]),
        "the rests of the film is 'none'",
    ),
    "all unsure": (film_with(likelihood=1.0), "lower the likelihood"),
    "likelihood": (film_with(likelihood=90.0), "the likelihood is 90.0"),
    "rate": (film_with(fps=0.0), "fps is 0.0"),
    "centre": (film_with(centre=True), "centre is 'asked for'"),
    "marker": (film_with(marker=(0.0, 0.0, 0.0)), "marker is 'given'"),
}


@pytest.mark.parametrize("case", WRONG)
def test_what_is_wrong_is_one_line_that_names_it(case, truth, table, tmp_path):
    make, said = WRONG[case]
    text, options = make(truth)
    path = tmp_path / "none.csv" if text is None else table(text)
    with pytest.raises(LimitsetsError) as caught:
        read(path, truth[1], **options)
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)
    if not isinstance(caught.value, DataError):
        assert case == "length"


# ----------------------------------------------------------------
# The command.


def words_of(camera):
    origin, along = camera.pair(0.0), camera.pair(25.0)
    return ["--origin", "{},{}".format(*origin), "--along", "{},{}".format(*along), "--length", "25 in"]


def test_the_command_writes_what_the_fit_takes(truth, table, tmp_path, capfd):
    path, out = table(spoilt("two points exchanged", *truth[0::2][:2], truth[3])), tmp_path / "throws.csv"
    words = ["film", SCENE, str(path), *words_of(truth[1]), "--fps", "60"]
    text = prints(capfd, *words, "-o", str(out))
    assert len(read_throws(out, ls.load(SCENE))) >= 16
    assert "left out, points exchanged or far off: frames" in text
    picture = out.with_suffix(".png")
    assert f"throws: {out}\npicture: {picture}\nnext: limitsets fit {SCENE} {out}" in text
    assert picture.read_bytes().startswith(b"\x89PNG")
    record = json_of(capfd, *words)
    assert set(record) == documented("film")
    assert record["throws"][0] == {"before": 0, "after": 1, "run": "tracks 1"}
    assert "add -o throws.csv" in prints(capfd, *words)


def test_the_figure_has_every_rest_throw_and_span_of_frames(truth, table):
    answer = read(table(in_table("DeepLabCut", truth)[0]), truth[1])
    (axes,) = ls.plot.film_rests(answer).axes
    drawn = Counter(line.get_gid() for line in axes.lines)
    spans = sum(map(len, answer.left_out.values()))
    assert drawn == {"rest": len(answer.seen.rests), "throw": len(answer.throws), "left out": spans}
    assert [text.get_text() for text in axes.texts] == [str(rest.side) for rest in answer.seen.rests]


def test_the_command_takes_corners_and_a_marker(truth, table, capfd):
    text, options = in_table("corners", truth)
    corners = [f"{x},{y}={a},{b}" for (x, y), (a, b) in options["corners"]]
    words = [word for each in corners for word in ("--corner", each)]
    assert len(json_of(capfd, "film", SCENE, str(table(text)), *words)["throws"]) == 20
    text, (x, y, turned) = in_table("marker", truth)[0], in_table("marker", truth)[1]["marker"]
    words = [*words_of(truth[1]), "--marker", f"{x},{y},{turned}"]
    assert len(json_of(capfd, "film", SCENE, str(table(text)), *words)["throws"]) == 20


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--origin", "3"], "--origin: the value is '3'"),
        (["--origin", "3 mm,4 mm"], "leave units out"),
        (["--corner", "3,4"], "PX,PY=X,Y"),
        (["--marker", "1,2"], "X,Y,ANGLE"),
    ],
)
def test_a_wrong_option_is_one_line(words, said, table, capfd):
    assert said in refusal(capfd, "film", SCENE, str(table(LONG)), *words)


# ----------------------------------------------------------------
# From films to intervals: they cover the truth.


def fitted(seed, path, throws=50):
    """Film a machine, find its throws, fit them: whether each interval that is given holds the truth."""
    draw = np.random.default_rng(seed)
    truth = machine(draw)
    film, camera = filmed(draw, truth, throws), Camera()
    path.write_text(deeplabcut(noisy(draw, camera(film.points()))))
    answer = read(path, camera)
    start = ls.load(SCENE)
    fit = ls.fit(start, answer.save(path.with_name("throws.csv")))
    speed = start.with_values({"throw.kappa": truth[KAPPA]}).value
    values = truth | {"throw.speed": speed("throw.speed")}
    return {each.name: bool(each.lo <= values[each.name] <= each.hi) for each in fit.quantities}


def test_the_fit_of_a_film_finds_the_machine(tmp_path):
    assert Counter(fitted(2, tmp_path / "tracks.csv").values()) == {True: 5}


@pytest.mark.sweep
def test_intervals_of_films_cover_the_truth(tmp_path):
    held, given = Counter(), Counter()
    for seed in range(20):
        for name, holds in fitted(seed, tmp_path / "tracks.csv").items():
            held[name] += holds
            given[name] += 1
    print(dict(held), dict(given))
    for name in ("throw.speed", ALONG, ABOVE, HEIGHT):
        assert given[name] == 20
        assert held[name] >= 17
    # many films bound the radius of gyration on no side, and give no interval
    assert held[RADIUS] >= 0.85 * given[RADIUS]
