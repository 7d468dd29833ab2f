"""Topic light_field: light that varies in space, and objects under it. Parts: objects (image-based objects)."""
from figure_topics import light_field_objects
from figure_topics.light_field_objects import measure_objects

MEASURES = {"objects": measure_objects}
PARTS = tuple(MEASURES)
TARGETS = [*light_field_objects.TARGETS]


def measure(programs, say, only=PARTS):
    for part in PARTS:
        if part in only:
            yield from MEASURES[part](programs, say)
