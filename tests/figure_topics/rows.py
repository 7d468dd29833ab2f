"""Rows of figures, and the judgement of each."""
import math


def row(name, asked, measured, unit, holds, real):
    return {"name": name, "asked": asked, "measured": measured, "unit": unit, "holds": bool(holds), "real": real}


def at_most(name, limit, measured, unit, real):
    """Nothing measured does not hold."""
    known = measured is not None and math.isfinite(measured)
    return row(name, f"<= {limit:g}", measured if known else "not measured", unit, known and measured <= limit, real)


def at_least(name, limit, measured, unit, real):
    known = measured is not None and math.isfinite(measured)
    return row(name, f">= {limit:g}", measured if known else "not measured", unit, known and measured >= limit, real)


def equals(name, value, measured, unit, real):
    return row(name, f"= {value:g}", measured if measured is not None else "not measured", unit, measured == value, real)
