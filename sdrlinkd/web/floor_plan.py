"""A floor plan under the map, as ROS's map_server keeps it: an image and a YAML file."""

import base64
import io
from pathlib import Path
from typing import NamedTuple

from PIL import Image, UnidentifiedImageError
from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError

from sdrlinkd.errors import UserError
from sdrlinkd.files import read_bounded

MOST_PIXELS = 40_000_000
FORMAT = "a YAML file of ROS's map_server, with image, resolution and origin"


class FloorPlan(NamedTuple):
    """An image as a data URL; its lower left corner and its size in m."""

    url: str
    x: float
    y: float
    width: float
    height: float


def read_floor_plan(path: Path) -> FloorPlan:
    """The plan that a YAML file of map_server describes. Raises UserError."""
    try:
        told = YAML(typ="safe").load(read_bounded(path).decode())
        resolution, (x, y, *_) = float(told["resolution"]), told["origin"]
        image = path.parent / str(told["image"])
        x, y = float(x), float(y)
    except OSError as error:
        raise UserError(f"--floor-plan {path}: {error.strerror}; allowed: {FORMAT}") from None
    except (YAMLError, UnicodeDecodeError, TypeError, KeyError, ValueError):
        raise UserError(f"--floor-plan {path}: cannot be read; allowed: {FORMAT}") from None
    try:
        with Image.open(image) as opened:
            width, height = opened.size
            if width * height > MOST_PIXELS:
                raise UserError(f"{image}: got {width} x {height} pixels; allowed: 40 million")
            png = io.BytesIO()
            opened.convert("L").save(png, "PNG")
    except (OSError, UnidentifiedImageError) as error:
        raise UserError(f"--floor-plan {path}: {image} is no image ({error})") from None
    url = "data:image/png;base64," + base64.b64encode(png.getvalue()).decode()
    return FloorPlan(url, x, y, width * resolution, height * resolution)
