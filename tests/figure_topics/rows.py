"""Rows of figures: a measured value, its requirement, and whether the requirement holds."""
import math


def row(name, asked, measured, unit, holds, real):
    return {"name": name, "asked": asked, "measured": measured, "unit": unit, "holds": bool(holds), "real": real}


def known_short(figure, reason):
    """Marks a row that is known to fall short with the reason. A row that was not measured stays unmarked."""
    return figure if figure["measured"] == "not measured" else {**figure, "known_short": reason}


def is_measured(measured):
    return measured is not None and math.isfinite(measured)


def at_most(name, limit, measured, unit, real):
    """A value that was not measured (None) or is not finite does not hold."""
    valid = is_measured(measured)
    return row(name, f"<= {limit:g}", measured if valid else "not measured", unit, valid and measured <= limit, real)


def at_least(name, limit, measured, unit, real):
    valid = is_measured(measured)
    return row(name, f">= {limit:g}", measured if valid else "not measured", unit, valid and measured >= limit, real)


def equals(name, value, measured, unit, real):
    valid = measured is not None
    return row(name, f"= {value:g}", measured if valid else "not measured", unit, measured == value, real)


def reported(name, measured, unit, real, published=None):
    """A row without a requirement: it holds once it is measured. `published`: a published value to compare with."""
    valid = is_measured(measured)
    asked = "reported" if published is None else f"reported, published {published:g}"
    return row(name, asked, measured if valid else "not measured", unit, valid, real)
