// Measures grids of light probes (lightwell-field --grid) in the path-traced rooms of tests/reference/mitsuba/field:
// harmonics interpolated between the points of a file against the field, and against the path tracer's answer. One JSON
// object per line.
//
// The grid fills the room but for a margin. Lights are in the harmonics, or apart: then those of the file are added as
// an engine without shadows shades them. A field with the room's geometry knows what hides a lamp from a point of the
// grid, which is then interpolated as well. Spacing 0: no grid, the file has the point itself.
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include <lightwell/field.hpp>

#include "field_grid.hpp"
#include "host_sdk/field/unity_grid_file.hpp"
#include "measure/field_rooms.hpp"
#include "measure/output.hpp"
#include "support/temp_dir.hpp"
#include "tools/command_line.hpp"

namespace {

using namespace lightwell;
using measure::FieldRoom;
using measure::PointTruth;
using reference::Rgb;
using reference::V3;
using test::UnityGridFile;
using tool::GridLights;
using tool::PointGrid;

constexpr double kMargin_m = 0.1;
constexpr std::array kSpacings_m{0.0, 0.25, 0.5, 1.0, 2.0};

using Coefficients = std::array<double, 27>;

V3 unity(Vec3d v) { return {v.x, v.y, -v.z}; }

/// Trilinear between the points of the file that have light. None where no point around has.
std::optional<Coefficients> interpolated(const UnityGridFile& file, const V3& at) {
  const auto counts = file.document.at("counts").get<std::array<std::size_t, 3>>();
  const auto origin = file.document.at("origin").get<std::array<double, 3>>();
  const auto spacing = file.document.at("spacing").get<std::array<double, 3>>();
  const std::array place{at.x, at.y, at.z};
  std::array<std::size_t, 3> cell{};
  std::array<double, 3> part{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (counts[axis] == 1) continue;
    const double u = (place[axis] - origin[axis]) / spacing[axis];
    cell[axis] = static_cast<std::size_t>(std::clamp(std::floor(u), 0.0, static_cast<double>(counts[axis] - 2)));
    part[axis] = u - static_cast<double>(cell[axis]);
  }
  Coefficients out{};
  double sum = 0;
  for (std::size_t corner = 0; corner < 8; ++corner) {
    const std::array<std::size_t, 3> upper{corner & 1U, corner >> 1U & 1U, corner >> 2U};
    double weight = 1;
    for (std::size_t axis = 0; axis < 3; ++axis) weight *= upper[axis] != 0 ? part[axis] : 1 - part[axis];
    if (!(weight > 0)) continue;
    const std::size_t i = cell[0] + upper[0] + counts[0] * (cell[1] + upper[1] + counts[1] * (cell[2] + upper[2]));
    if (file.validity.at(i) == 0) continue;
    sum += weight;
    for (std::size_t k = 0; k < out.size(); ++k) out[k] += weight * file.harmonics.at(27 * i + k);
  }
  if (!(sum > 0)) return std::nullopt;
  for (double& c : out) c /= sum;
  return out;
}

/// Sums of squares over normals and channels.
struct Squares {
  double difference = 0, truth = 0;

  void add(const Rgb& value, const std::array<double, 3>& truth_value) {
    for (std::size_t c = 0; c < 3; ++c) {
      difference += (value[c] - truth_value[c]) * (value[c] - truth_value[c]);
      truth += truth_value[c] * truth_value[c];
    }
  }
  [[nodiscard]] double relative_square() const { return difference / truth; }
};

class GridMeasure {
 public:
  GridMeasure(const FieldRoom& room, const LightField& field, std::string method, GridLights lights)
      : room_(room), field_(field), method_(std::move(method)), lights_(lights) {}

  void measure(double spacing_m) const {
    const Vec3d half{room_.size.x / 2 - kMargin_m, 0, room_.size.z / 2 - kMargin_m};
    std::optional<UnityGridFile> grid;
    double ms = 0;
    if (spacing_m > 0) {
      const auto begin = std::chrono::steady_clock::now();
      grid = file_of(require(PointGrid::with_spacing({-half.x, kMargin_m, -half.z},
                                                     {half.x, room_.size.y - kMargin_m, half.z}, spacing_m)));
      ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
    }
    double interpolation = 0, to_truth = 0, to_truth_visible = 0;
    std::vector<double> interpolations;
    std::size_t visible = 0, without_light = 0;
    for (const PointTruth& point : room_.points) {
      const UnityGridFile here = file_of({point.position, point.position, {1, 1, 1}});
      const V3 place = unity(point.position);
      const std::optional<Coefficients> between = interpolated(grid ? *grid : here, place);
      if (!between || here.validity[0] == 0) {
        ++without_light;
        continue;
      }
      // Relative to all light: the lights apart are the same in both.
      Squares of_interpolation, of_truth;
      for (std::size_t n = 0; n < room_.normals.size(); ++n) {
        const V3 normal = unity(vec_cast<double>(room_.normals[n]));
        const Rgb rest = UnityGridFile::irradiance_of(between->data(), normal), exact = here.irradiance(0, normal);
        const Rgb direct = here.irradiance_of_lights(place, normal);
        const auto sum = [&](const Rgb& a) { return Rgb{a[0] + direct[0], a[1] + direct[1], a[2] + direct[2]}; };
        of_interpolation.add(sum(rest), sum(exact));
        of_truth.add(sum(rest), point.irradiance[n]);
      }
      interpolation += of_interpolation.relative_square();
      interpolations.push_back(std::sqrt(of_interpolation.relative_square()));
      to_truth += of_truth.relative_square();
      if (!point.visible()) continue;
      to_truth_visible += of_truth.relative_square();
      ++visible;
    }
    std::ranges::sort(interpolations);
    const std::size_t lit = interpolations.size();
    measure::print_line({{"room", room_.name},
                         {"method", method_},
                         {"grid_lights", lights_ == GridLights::apart ? "apart" : "in harmonics"},
                         {"spacing_m", spacing_m},
                         {"grid_points", grid ? grid->size() : 0},
                         {"grid_ms", ms},
                         {"lit", lit},
                         {"without_light", without_light},
                         {"visible", visible},
                         {"interpolation_square", interpolation / static_cast<double>(lit)},
                         {"interpolation_95", interpolations.at(lit * 95 / 100)},
                         {"truth_square", to_truth / static_cast<double>(lit)},
                         {"truth_square_visible", to_truth_visible / static_cast<double>(visible)}});
  }

 private:
  [[nodiscard]] UnityGridFile file_of(const PointGrid& grid) const {
    const std::string path = folder_.path("grid.json");
    require(tool::write_field_grid(field_, {}, grid, lights_, path));
    return UnityGridFile(path);
  }

  const FieldRoom& room_;
  const LightField& field_;
  std::string method_;
  GridLights lights_;
  test::TempDir folder_;
};

void measure_room(const std::string& name) {
  const FieldRoom room = require(measure::load_field_room(measure::field_rooms_folder(), name));
  const std::vector<FieldSample> samples = measure::samples_of(room, require(measure::probe_descriptors(room)));
  LightField field = require(LightField::make());
  for (std::size_t k = 0; k < samples.size(); ++k) require(field.set("probe " + std::to_string(k), samples[k]));
  (void)field.update({});
  for (const GridLights lights : {GridLights::in_harmonics, GridLights::apart}) {
    const GridMeasure grid(room, field, "field", lights);
    for (const double spacing : kSpacings_m) grid.measure(spacing);
  }
  if (!field_has_geometry()) return;
  const measure::RoomGeometry geometry = measure::geometry_of(room);
  require(field.set_geometry({geometry.vertices, geometry.indices}));
  (void)field.update({});
  const GridMeasure grid(room, field, "field with geometry", GridLights::in_harmonics);
  for (const double spacing : kSpacings_m) grid.measure(spacing);
}

}  // namespace

int main(int argc, char** argv) {
  std::string only;
  CLI::App app{"Error of a light field's probe grids against their spacing.", "measure_field_grid"};
  app.add_option("--room", only, "Measure this room alone: square, corridor or corner");
  app.footer("Exit status: 0 measured, 1 failed, 2 wrong usage.");
  return lightwell::run_command(app, {argv + 1, argv + argc}, [&] {
    for (const char* name : measure::kFieldRooms)
      if (only.empty() || only == name) measure_room(name);
    return 0;
  });
}
