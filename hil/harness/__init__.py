"""What runs, reaches and judges boards: Python's standard library alone."""
