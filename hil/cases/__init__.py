"""Tests that run on a board: one file per topic, one function case(rig, test, measured) per test of the roster."""
