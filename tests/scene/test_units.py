import re
from decimal import Decimal
from fractions import Fraction

import pint
import pytest
from hypothesis import given
from hypothesis import strategies as st

from limitsets.base.errors import SceneError
from limitsets.feeder.scene.quantities import base_unit
from limitsets.feeder.scene.units import UNITS, convert, exact_factor, parse, spelled_plainly, written


def test_factors_are_those_of_pints_own_registry() -> None:
    full = pint.UnitRegistry(non_int_type=Fraction)
    for dimension, units in UNITS.items():
        for unit in units if dimension != "share" else ():
            for target in (*units, *(base_unit(dimension, length) for length in UNITS["length"])):
                factor = full.Quantity(Fraction(1), unit).to(target).magnitude
                assert convert(parse(f"1 {unit}", dimension), target) == float(factor)


def test_what_measures_different_things_has_no_factor() -> None:
    for unit, target in (("in", "kg"), ("kg/m^2", "kg/m^3"), ("rpm", "rad"), ("Hz", "rad/s")):
        with pytest.raises(ValueError, match="measure different things"):
            exact_factor(unit, target)


@pytest.mark.parametrize(
    ("text", "dimension", "unit", "value"),
    [
        ("5.75 in", "length", "in", 5.75),
        ("0.1 in", "length", "in", 0.1),
        ("2.54 cm", "length", "in", 1.0),
        ("1 ft", "length", "in", 12.0),
        ("-.5e1 in", "length", "in", -5.0),
        ("+7. in", "length", "in", 7.0),
        ("0 m", "length", "in", 0.0),
        ("1   in", "length", "mm", 25.4),
        ("180 deg", "angle", "rad", 3.141592653589793),
        ("360 deg/s", "angular speed", "rad/s", 6.283185307179586),
        ("9.80665 m/s^2", "acceleration", "in/s^2", 9.80665 / 0.0254),
        ("1 lb", "mass", "kg", 0.45359237),
        ("1 kg/m^2", "mass per area", "kg/in^2", 0.00064516),
        ("1 %", "share", "", 0.01),
        ("0.7%", "share", "", 0.007),
        ("600 um", "length", "mm", 0.6),
        ("600 \u00b5m", "length", "mm", 0.6),  # micro sign
        ("600 \u03bcm", "length", "mm", 0.6),  # Greek mu
        ("45 \u00b0", "angle", "deg", 45.0),
        ("45\u00b0", "angle", "deg", 45.0),
        ("25 rpm", "angular speed", "deg/s", 150.0),  # 25 turns of 360 deg in 60 s
        ("60 rpm", "angular speed", "rad/s", 6.283185307179586),
        ("6000 mg", "mass", "g", 6.0),
        ("2 t", "mass", "kg", 2000.0),
        ("0.3 g/cm^2", "mass per area", "kg/m^2", 3.0),
        ("7.85 g/cm^3", "mass per volume", "kg/m^3", 7850.0),
    ],
)
def test_values(text: str, dimension: str, unit: str, value: float) -> None:
    assert convert(parse(text, dimension), unit) == value


@given(st.floats(1e-12, 1e12), st.sampled_from(UNITS["length"]), st.sampled_from(UNITS["length"]))
def test_conversions_are_rounded_once(number: float, unit: str, target: str) -> None:
    metres = {"m": "1", "cm": "0.01", "mm": "0.001", "um": "1e-6", "in": "0.0254", "ft": "0.3048"}
    exact = Fraction(Decimal(repr(number))) * Fraction(metres[unit]) / Fraction(metres[target])
    assert convert(parse(written(number, unit), "length"), target) == float(exact)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("5,75 in", "decimal point"),
        ("5.75,3 in", "commas"),
        ("9**9**9 in", "one finite decimal number"),
        ("1/s", "one finite decimal number"),
        ("1 1/s", "1/s is a unit of frequency: the dimension is wrong"),
        ("nan in", "finite"),
        ("inf in", "finite"),
        ("-Infinity in", "finite"),
        ("1e400 in", "size from"),
        ("1e-400 in", "size from"),
        ("1e9999 in", "one finite"),
        ("-1e13 in", "choose another unit"),
        ("5.75", "add the unit"),
        ("5.75in", "a space between"),
        ("in", "one finite decimal number"),
        ("", "one finite decimal number"),
        ("5.75 inch", "did you mean 'in'"),
        ("5.75 In", "did you mean 'in'"),
        ("5.75 parsec", "not known"),
        ("5.75 deg", "deg is a unit of angle: the dimension is wrong"),
        ("5.75 in\n", "one finite"),
        ("5.75\u00a0in", "one finite"),
        ("\u0665 in", "one finite"),
        ("1_0 in", "one finite"),
        ("0x10 in", "one finite"),
        ("5.75 in in", "not known"),
        ("1" * 100 + " in", "shorten"),
        (5.75, "write it as text"),
        (5, "write it as text"),
        (True, "write it as text"),
        (None, "write it as text"),
        (["5.75 in"], "write it as text"),
    ],
)
def test_refuses(text: object, words: str) -> None:
    with pytest.raises(SceneError) as caught:
        parse(text, "length", key="arm.length", file="arm.toml")
    error = caught.value
    assert (error.key, error.file) == ("arm.length", "arm.toml")
    assert words in str(error)
    assert "m, cm, mm, in, ft" in error.allowed


@pytest.mark.parametrize(
    ("text", "dimension", "words"),
    [
        ("2 rps", "angular speed", 'write "720 deg/s"'),
        ("120 /min", "frequency", 'write "2 Hz"'),
        ("120/min", "frequency", 'write "2 Hz"'),
        ("2/s", "frequency", "did you mean 'Hz'?"),
        ("25 rev/min", "angular speed", "did you mean 'rpm'?"),
        ("25 RPM", "angular speed", "did you mean 'rpm'?"),
        ("158 \u00b0/s", "angular speed", "did you mean 'deg/s'?"),
        ("6 rad/min", "angular speed", 'write "0.1 rad/s"'),
        ("25 Hz", "angular speed", 'Hz is a unit of frequency: if it counts turns, write "1500 rpm"'),
        ("120 /min", "angular speed", 'if it counts turns, write "120 rpm"'),
        ("90 rpm", "frequency", 'rpm is a unit of angular speed: if each turn throws once, write "1.5 Hz"'),
        ("540 deg/s", "frequency", 'if each turn throws once, write "1.5 Hz"'),
        ("6.283185307179586 rad/s", "frequency", 'if each turn throws once, write "1 Hz"'),
        ("90 rev/min", "frequency", 'if each turn throws once, write "1.5 Hz"'),
        ("90 throws/min", "frequency", 'write "1.5 Hz"'),
        ("0.5 s", "frequency", 's is a unit of time: if it is that from throw to throw, write "2 Hz"'),
        ("250 ms", "frequency", 'write "4 Hz"'),
        ("0 s", "frequency", "convert the value"),
        ("0.5 turn", "angle", 'write "180 deg"'),
        ("0.5 g", "acceleration", 'g is a unit of mass: if it is that of free fall, write "4.903325 m/s^2"'),
        ("0.5 kg", "acceleration", "kg is a unit of mass: the dimension is wrong"),
        ("25 kHz", "angular speed", "convert the value"),  # of what, is not said
        ("45 \u00ba", "angle", "did you mean 'deg'?"),  # the sign of an ordinal
        ("3 km", "length", 'write "3000 m"'),
        ("3 dm", "length", 'write "0.3 m"'),
        ("3 nm", "length", "convert the value"),
        ("3e999 km", "length", "size from"),  # no float to propose
        ("3 MM", "length", "did you mean 'mm'?"),
        ("25 rpm", "length", "rpm is a unit of angular speed: the dimension is wrong"),
        ("25 km", "mass", "km is a unit of length: the dimension is wrong"),
        ("2 Mg", "mass", "did you mean 't'?"),
        ("2 oz", "mass", 'write "56.69904625 g"'),
        ("2 \u00b5g", "mass", 'write "2e-06 g"'),
        ("0.2 N", "mass", "N is a unit of force, and a mass is wanted: give kg"),
        ("0.2 N", "length", "N is a unit of force: the dimension is wrong"),
        ("300 g/m^2", "mass per area", 'write "0.3 kg/m^2"'),
        ("300 g/m\u00b2", "mass per area", 'write "0.3 kg/m^2"'),
        ("7850 kg/m\u00b3", "mass per volume", "did you mean 'kg/m^3'?"),
        ("7.85 t/m^3", "mass per volume", 'write "7850 kg/m^3"'),
        ("7.85 kg/dm^3", "mass per volume", "did you mean 'g/cm^3'?"),
        ("9.8 m/s2", "acceleration", "did you mean 'm/s^2'?"),
        ("600\u00b5m", "length", 'put a space between number and unit: "600 \u00b5m"'),
    ],
)
def test_what_is_proposed_is_the_same_value(text: str, dimension: str, words: str) -> None:
    with pytest.raises(SceneError) as caught:
        parse(text, dimension)
    assert words in caught.value.remedy


@pytest.mark.parametrize("text", ["5", "banana", "5,75 mm", 5.75])
@pytest.mark.parametrize(
    ("dimension", "units"), [("length", ("mm", "in")), ("acceleration", ("mm/s^2", "in/s^2"))]
)
def test_examples_are_in_millimetres_and_in_inches(
    text: object, dimension: str, units: tuple[str, str]
) -> None:
    """A scene has one or the other, and an example in the other alone looks like a demand."""
    with pytest.raises(SceneError) as caught:
        parse(text, dimension)
    examples = re.findall(r'"[0-9.]+ ([^"]+)"', caught.value.remedy)
    assert tuple(examples) == units
    values = [
        convert(parse(each, dimension), units[0]) for each in re.findall(r'"([^"]+)"', caught.value.remedy)
    ]
    assert values[0] == pytest.approx(values[1], rel=0.01)


def test_spellings_for_certificates() -> None:
    tree = {
        "x": " 600   \u00b5m ",
        "of": [["45\u00b0", "1 \u03bcm"], 3, True, None],
        "name": "\u00b5m",
        "w": "25  rpm",
        "share": "1%",
        "said": "5  parsec",
    }
    wanted = {
        "x": "600 um",
        "of": [["45 deg", "1 um"], 3, True, None],
        "name": "\u00b5m",
        "w": "25 rpm",
        "share": "1 %",
        "said": "5  parsec",
    }
    assert spelled_plainly(tree) == wanted


@given(st.text(max_size=80))
def test_any_text_is_read_or_refused(text: str) -> None:
    for dimension in UNITS:
        try:
            quantity = parse(text, dimension)
        except SceneError:
            continue
        assert quantity.unit in UNITS[dimension]
