"""Topic light_field: light that varies in space, and objects under it. Parts: rooms (the light field)."""
from figure_topics import light_field_rooms
from figure_topics.light_field_rooms import measure_rooms

MEASURES = {"rooms": measure_rooms}
PARTS = tuple(MEASURES)
TARGETS = [*light_field_rooms.TARGETS]


def measure(programs, say, only=PARTS):
    for part in PARTS:
        if part in only:
            yield from MEASURES[part](programs, say)
