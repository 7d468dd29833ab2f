"""Rows of figures, and the judgement of each."""
import math


def row(name, asked, measured, unit, holds, real):
    return {"name": name, "asked": asked, "measured": measured, "unit": unit, "holds": bool(holds), "real": real}


def known_short(judged, reason):
    """Marks a row that is known to fall short, and why. What was not measured is not excused by it."""
    return judged if judged["measured"] == "not measured" else {**judged, "known_short": reason}


def known(measured):
    return measured is not None and math.isfinite(measured)


def at_most(name, limit, measured, unit, real):
    """Nothing measured does not hold."""
    there = known(measured)
    return row(name, f"<= {limit:g}", measured if there else "not measured", unit, there and measured <= limit, real)


def at_least(name, limit, measured, unit, real):
    there = known(measured)
    return row(name, f">= {limit:g}", measured if there else "not measured", unit, there and measured >= limit, real)


def equals(name, value, measured, unit, real):
    there = measured is not None
    return row(name, f"= {value:g}", measured if there else "not measured", unit, measured == value, real)


def reported(name, measured, unit, real, beside=None):
    """Nothing is promised but that it is measured. `beside`: a published figure to read it by."""
    there = known(measured)
    asked = "reported" if beside is None else f"reported, published {beside:g}"
    return row(name, asked, measured if there else "not measured", unit, there, real)
