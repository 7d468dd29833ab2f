// Prints the library's version; fails if it is not that of the headers, or a light cannot be estimated.
#include <cstdio>

#include <lightwell/light_estimate.h>
#include <lightwell/lightwell_c.hpp>

int main() {
  const auto light = lw::Lighting::create();
  auto estimate = lw::sized<lw_light_estimate>();
  std::printf("Lightwell %s, ABI %x\n", lw_version(), lw_abi_version());
  const bool answers = light.ok() && lw_lighting_estimate(light->get(), nullptr, &estimate) == LW_OK;
  return answers && estimate.validity == LW_NONE && lw_abi_version() == LW_ABI_VERSION ? 0 : 1;
}
