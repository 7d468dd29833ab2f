"""Topic light_field: light that varies in space, and objects under it. Parts: rooms (the light field), grids (its light
probes for engines), objects (image-based objects), relight (performances)."""
from figure_topics import light_field_grids, light_field_objects, light_field_relight, light_field_rooms

MEASURES = {"rooms": light_field_rooms.measure_rooms, "grids": light_field_grids.measure_grids,
            "objects": light_field_objects.measure_objects, "relight": light_field_relight.measure_relight}
PARTS = tuple(MEASURES)
TARGETS = [*light_field_rooms.TARGETS, *light_field_grids.TARGETS, *light_field_objects.TARGETS,
           *light_field_relight.TARGETS]


def measure(programs, say, only=PARTS):
    for part in PARTS:
        if part in only:
            yield from MEASURES[part](programs, say)
