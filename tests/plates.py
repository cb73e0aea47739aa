"""A steel plate with a lead weight, in millimetres, and scenes that differ from it in a few lines."""

PLATE = """
[part]
vertices = [["0 mm", "0 mm"], ["80 mm", "0 mm"], ["62 mm", "45 mm"], ["12 mm", "45 mm"]]
[part.mass]
plate_density = "7850 kg/m^3"
plate_thickness = "2 mm"
points = [{ x = "58 mm", y = "9 mm", mass = "18 g" }]
[arm]
surface_height = "-8 mm"
length = "400 mm"
[throw]
speed = "180 deg/s"
[gravity]
tilt = "30 deg"
"""


def plate(*changes: tuple[str, str], name: str = "plate", more: str = "") -> str:
    """The scene's text with another name and more tables, each change made in it."""
    text = f'name = "{name}"\n{PLATE}{more}'
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    return text
