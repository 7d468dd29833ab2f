"""What is tested on a board: one file a topic, one function a test of the roster, case(rig, test, measured)."""
