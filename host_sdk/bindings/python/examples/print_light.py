# Prints the light of a probe: python3 print_light.py ws://192.168.1.20:7443
import sys
import lightwell
with lightwell.connect(sys.argv[1]) as probe:
    light = probe.wait_for_next(timeout=5)
    print("irradiance from above", light.irradiance([0, 1, 0]).value)
    for found in light.lights():
        print("light towards", found.direction)
