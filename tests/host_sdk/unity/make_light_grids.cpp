// Writes grids of a field, and the irradiance that it answers at their points, for LightGridTest.cs.
// usage: make_light_grids FOLDER
#include <cmath>
#include <cstdio>
#include <fstream>
#include <string>

#include "field_grid.hpp"
#include "host_sdk/field/field_scenes.hpp"

namespace {

using namespace lightwell;

/// Normals that cover the sphere evenly: a Fibonacci lattice.
Vec3f normal_of(int i, int count) {
  const double z = 1 - (2 * i + 1.0) / count, r = std::sqrt(1 - z * z), a = 2.399963229728653 * i;
  return vec_cast<float>(Vec3d{r * std::cos(a), r * std::sin(a), z});
}

bool wrote(const Status& status) {
  if (!status.ok()) std::fprintf(stderr, "%s\n", status.message().c_str());
  return status.ok();
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) return std::fprintf(stderr, "usage: make_light_grids FOLDER\n"), 2;
  const std::string folder = argv[1];
  const Vec3d lamp{0.4, 1.7, -0.3};  // At a point of the grid.
  const LightField field =
      test::field_of({.lamps = {{lamp}, {{-1.1, 2.4, 0.9}, {1, 2, 4}}}, .sun = {2, 2, 1.5F}}, test::four_places());
  const auto grid = tool::PointGrid::with_spacing(lamp - Vec3d{1, 1, 1}, lamp + Vec3d{1, 0, 1}, 1);
  if (!grid.ok() ||
      !wrote(tool::write_field_grid(field, {}, *grid, tool::GridLights::in_harmonics, folder + "/grid.json")) ||
      !wrote(tool::write_field_grid(field, {}, *grid, tool::GridLights::apart, folder + "/apart.json")))
    return 1;
  std::ofstream out(folder + "/irradiances.txt");
  out.precision(9);
  int index = 0;
  // In the order of the file: its z is ours negated.
  for (int z = 1; z >= -1; --z)
    for (int y = -1; y <= 0; ++y)
      for (int x = -1; x <= 1; ++x, ++index) {
        if (x == 0 && y == 0 && z == 0) continue;
        const Vec3d p = lamp + Vec3d(x, y, z);
        const Lighting here = field.at(p, {}).light;
        for (int i = 0; i < 64; ++i) {
          const Vec3f n = normal_of(i, 64);
          const Irradiance e = here.irradiance(n).value;
          out << index << ' ' << p.x << ' ' << p.y << ' ' << p.z << ' ' << n.x << ' ' << n.y << ' ' << n.z << ' ' << e.r
              << ' ' << e.g << ' ' << e.b << '\n';
        }
      }
  out.flush();
  return out ? 0 : 1;
}
