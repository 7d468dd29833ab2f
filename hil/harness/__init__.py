"""Starts, reaches and tests boards."""
