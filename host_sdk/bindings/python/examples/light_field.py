# The light at a point between probes: python3 light_field.py 0,1,0 ws://hall.local@-1.5,1.2,0 ws://stage.local@2,1,0
import sys
import lightwell

point, *probes = sys.argv[1:]
field = lightwell.LightField()
for probe in probes:
    uri, place = probe.rsplit("@", 1)
    with lightwell.connect(uri) as connection:
        field.set(uri, connection.wait_for_next(timeout=5), [float(v) for v in place.split(",")],
                  position_sigma=0.01, orientation_sigma=0.01)
state = field.update()
print(len(state.lights), "lights in space,", len(state.probes), "probes")
here = field.at([float(v) for v in point.split(",")])
print("irradiance from above", here.light.irradiance([0, 1, 0]).value, "within", here.error_bound)
