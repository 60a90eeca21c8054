"""Pictures of experiments: no window, small files."""

from collections.abc import Generator
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path

from matplotlib.figure import Figure
from PIL import Image

DPI = 90
COLOURS = 96
"""Of the palette: enough for lines and text, and a third of the bytes."""

STYLES = {
    "ecpso": ("E-CPSO", "#c1272d"),
    "pso": ("PSO", "#0000a7"),
    "ipso": ("IPSO", "#008176"),
    "gapso": ("GAPSO", "#eecc16"),
    "ca": ("CA", "#7e2f8e"),
    "aca": ("ACA", "#6b6b6b"),
    "shipped": ("shipped planner", "#000000"),
}
"""Label and colour of each algorithm."""


@contextmanager
def picture(path: Path, width_in: float, height_in: float) -> Generator[Figure]:
    """A matplotlib figure that is written to a PNG file, in few colours, when the block is left."""
    figure = Figure(figsize=(width_in, height_in), dpi=DPI, layout="constrained")
    yield figure
    drawn = BytesIO()
    figure.savefig(drawn, format="png")
    with Image.open(drawn) as image:
        image.convert("RGB").quantize(COLOURS).save(path, optimize=True)
