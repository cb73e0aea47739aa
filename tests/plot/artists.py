"""What a figure holds."""

from matplotlib.backends.backend_agg import FigureCanvasAgg


def named(axes, gid):
    """Give the artists of this name."""
    return [artist for artist in axes.get_children() if artist.get_gid() == gid]


def drawn(figure):
    """Give the figure after it was drawn: places of texts are known then."""
    FigureCanvasAgg(figure).draw()
    return figure
