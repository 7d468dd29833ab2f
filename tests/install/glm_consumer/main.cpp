// An application with GLM outside the source tree: lightwell/glm.hpp is installed and its conversions are correct.
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <iostream>

#include <lightwell/glm.hpp>
#include <lightwell/lighting.hpp>
#include <lightwell/probe.hpp>

namespace {

int failures = 0;

void expect(bool holds, const char* what) {
  if (holds) return;
  std::cerr << "does not hold: " << what << '\n';
  ++failures;
}

bool near(double a, double b) { return std::abs(a - b) < 1e-5; }

template <class V>
bool near3(const V& a, double x, double y, double z) {
  return near(a.x, x) && near(a.y, y) && near(a.z, z);
}

}  // namespace

int main() {
  using namespace lightwell;

  expect(near3(to_glm(Vec3f{1, 2, 3}), 1, 2, 3), "vectors keep their order");
  expect(near3(from_glm(glm::dvec3(1, 2, 3)), 1, 2, 3), "vectors come back");

  // A rotation by pi/2 about up maps +X to -Z, for both.
  const Quat quarter = Quat::about({0, 1, 0}, std::acos(-1.0) / 2);
  expect(near3(to_glm(quarter) * glm::dvec3(1, 0, 0), 0, 0, -1), "quaternions turn the same way");
  expect(near3(rotate(from_glm(to_glm(quarter)), Vec3d{1, 0, 0}), 0, 0, -1), "quaternions come back");

  const Pose pose{quarter, {4, 5, 6}};
  const glm::dvec4 moved = to_glm(pose) * glm::dvec4(1, 0, 0, 1);
  expect(near3(moved, 4, 5, 5) && near(moved.w, 1), "a pose is a model matrix");
  expect(near3(transformed(from_glm(to_glm(pose)), {1, 0, 0}), 4, 5, 5), "poses come back");

  expect(near3(to_glm(Radiance{1, 2, 3}), 1, 2, 3), "colours are r, g, b");
  expect(color_from_glm<Irradiance>(glm::vec3(1, 2, 3)) == Irradiance{1, 2, 3}, "colours come back");
  ColorMatrix mix;
  mix.m = {{{1, 2, 0}, {0, 1, 0}, {0, 0, 3}}};
  expect(near3(to_glm(mix) * glm::vec3(1, 10, 100), 21, 10, 300), "colour matrices are not transposed");
  expect(from_glm(to_glm(mix)) == mix, "colour matrices come back");

  // A light to the right and a grey room, evaluated by the shader in the header's comment.
  Descriptor room;
  room.radiance.band = 0;
  room.radiance.c[0] = Radiance{1, 1, 1} * 3.5449077F;
  Light lamp;
  lamp.direction = {1, 0, 0};
  lamp.irradiance = {8, 4, 2};
  room.lights.push_back(lamp);
  const auto lit = to_filament(Lighting::of(room), MainLight::in_harmonics);
  const auto sh = irradiance_uniform(lit.value);
  const auto shade = [&](const glm::vec3& n) {
    return glm::vec3(sh[0] + sh[1] * n.y + sh[2] * n.z + sh[3] * n.x + sh[4] * (n.x * n.y) + sh[5] * (n.y * n.z) +
                     sh[6] * (3 * n.z * n.z - 1) + sh[7] * (n.x * n.z) + sh[8] * (n.x * n.x - n.y * n.y));
  };
  const double pi = std::acos(-1.0);
  // A light in bands 0 to 2 gives 1/4 + 1/2 + 5/16 of its irradiance facing it, 1/4 - 1/2 + 5/16 facing away.
  expect(near(shade({1, 0, 0}).r, 1 + 8 * 1.0625 / pi), "the shader sees the lamp");
  expect(near(shade({-1, 0, 0}).g, 1 + 4 * 0.0625 / pi), "and not from behind");

  const auto uniform = sh_uniform<2>(room.radiance);
  expect(uniform.size() == 9 && near(uniform[0].x, 3.5449077) && near(uniform[8].z, 0), "missing bands are zero");
  expect(sizeof(uniform) == 9 * 4 * sizeof(float), "vec4 is the stride of a uniform block");

  if (failures != 0) return EXIT_FAILURE;
  std::cout << "lightwell " << version() << '\n';
  return EXIT_SUCCESS;
}
