// Prints the light of a probe: print_light ws://192.168.1.20:7443
#include <cstdio>

#include <lightwell/probe.hpp>

int main(int argc, char** argv) {
  const auto probe = lightwell::Probe::connect(argc > 1 ? argv[1] : "ws://127.0.0.1:7443");
  const auto light = probe.ok() ? probe->wait_for_next({}, lightwell::Duration::from_seconds(5)) : probe.status();
  if (!light.ok()) return std::fprintf(stderr, "%s\n", light.status().message().c_str()), 1;
  const auto up = light->irradiance({0, 1, 0});  // lux, where the probe's units are absolute
  std::printf("irradiance from above %.6g %.6g %.6g, within %.2g\n", up.value.r, up.value.g, up.value.b,
              up.error_bound);
  for (const lightwell::Light& l : light->lights())
    std::printf("light towards %.4f %.4f %.4f\n", l.direction.x, l.direction.y, l.direction.z);
  return 0;
}
