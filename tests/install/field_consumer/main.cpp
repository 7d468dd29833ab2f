// An application with a light field outside the source tree: the component `field` is installed with all that it needs.
#include <cstdlib>
#include <iostream>

#include <lightwell/field.hpp>
#include <lightwell/probe.hpp>

int main() {
  using namespace lightwell;
  auto field = LightField::make();
  if (!field.ok()) return EXIT_FAILURE;
  FieldSample sample;
  sample.light.radiance.c[0] = {1, 1, 1};
  if (!field->set("probe", sample).ok()) return EXIT_FAILURE;
  if (field->update({})->probes.size() != 1) return EXIT_FAILURE;
  if (field->irradiance({0, 0, 0}, {0, 1, 0}, {}).validity != Validity::valid) return EXIT_FAILURE;
  std::cout << "lightwell " << version() << '\n';
  return EXIT_SUCCESS;
}
