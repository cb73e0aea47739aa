"""What is sent to the browser to be drawn."""

import base64
import json

import numpy as np
import pytest

from limitsets.face.explorer.canvas import Canvas, Layer


def test_points_beyond_the_picture_are_left_out():
    """The numbers that are sent reach from one end of the picture to the other: beyond, they would come round."""
    layer = Layer("dots", "points")
    layer.data = {"x": [-1.0, 3.0, 6.0, 3.0, 5.0], "y": [0.5, 0.25, 0.5, 1.5, 1.0]}
    canvas = Canvas("map", [layer], 100, x=[1.0, 5.0], y=[0.0, 1.0])
    (sent,) = json.loads(canvas.drawn)["layers"]
    places = np.frombuffer(base64.b64decode(sent["packed"]), "<u2").reshape(-1, 2) / 65535
    assert places == pytest.approx(np.array([[0.5, 0.25], [1.0, 1.0]]), abs=1e-5)
