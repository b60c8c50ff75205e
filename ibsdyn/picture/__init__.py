"""What a model looks like: its parts as points, faces and lines that move with the model's coordinates."""

from ibsdyn.picture.line import lined_up_shapes
from ibsdyn.picture.shape import BOX_EDGES, BOX_FACES, Shape
from ibsdyn.picture.space import arrow, box_corners, model_size, point_rows, shapes_in_space

__all__ = [
    "BOX_EDGES",
    "BOX_FACES",
    "Shape",
    "arrow",
    "box_corners",
    "lined_up_shapes",
    "model_size",
    "point_rows",
    "shapes_in_space",
]
