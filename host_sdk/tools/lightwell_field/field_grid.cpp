#include "field_grid.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <numbers>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include <lightwell/conventions.hpp>
#include <lightwell/text.hpp>

#include "common.hpp"

namespace lightwell::tool {
namespace {

using nlohmann::ordered_json;

constexpr std::size_t kBatch = 512;  // Points of one query of the field.
/// Bit of an answer of old samples, above those of FieldFlag.
constexpr unsigned kStale = 1U << kFieldFlags.size();

/// A point of the file.
struct GridProbe {
  UnityLighting light;
  float bound = -1, residual = -1;  ///< -1: none.
  bool has_light = false;
  unsigned flags = 0;
};

/// Unity's axes: left-handed, +Z forward.
template <class T>
std::array<T, 3> unity(Vec3<T> v) {
  return {v.x, v.y, -v.z};
}

/// Coordinate of point i of n; the last is `to` itself.
double coordinate(double from, double to, std::size_t i, std::size_t n) {
  return i + 1 == n ? to : from + (to - from) * static_cast<double>(i) / static_cast<double>(n - 1);
}

/// In the order of the file: x fastest, then y, then Unity's z, which rises as ours falls.
Vec3d point_of(const PointGrid& grid, std::size_t index) {
  const auto [nx, ny, nz] = grid.counts;
  const std::size_t ix = index % nx, iy = index / nx % ny, iz = nz - 1 - index / nx / ny;
  return {coordinate(grid.from.x, grid.to.x, ix, nx), coordinate(grid.from.y, grid.to.y, iy, ny),
          coordinate(grid.from.z, grid.to.z, iz, nz)};
}

/// Without the lights of these identities.
Lighting without(const Lighting& light, std::span<const std::uint32_t> ids) {
  Descriptor rest = light.descriptor();
  std::erase_if(rest.lights, [&](const Light& l) { return std::ranges::find(ids, l.track) != ids.end(); });
  return Lighting::of(std::move(rest));
}

GridProbe probe_of(const FieldAnswer& answer, std::span<const std::uint32_t> apart) {
  GridProbe out;
  for (const FieldFlag f : kFieldFlags)
    if (answer.flags.has(f)) out.flags |= 1U << static_cast<unsigned>(f);
  const Validity validity = answer.light.validity();
  if (validity == Validity::stale) out.flags |= kStale;
  if ((validity != Validity::valid && validity != Validity::stale) || answer.flags.has(FieldFlag::at_light)) return out;
  const Converted<UnityLighting> converted = to_unity(apart.empty() ? answer.light : without(answer.light, apart),
                                                      UnityPipeline::universal, MainLight::in_harmonics);
  if (!converted.has_estimate()) return out;
  out.has_light = true;
  out.light = converted.value;
  const float bound = answer.light.descriptor().bound.total;
  if (std::isfinite(bound)) out.bound = bound;
  out.residual = converted.residual.value_or(-1);
  return out;
}

ordered_json json_of(const FieldLight& light) {
  const auto [r, g, b] = std::array{light.intensity.r, light.intensity.g, light.intensity.b};
  const float largest = std::max({r, g, b, 1e-20F});
  const Vec3f forward = light.placed ? Vec3f{0, -1, 0} : -light.direction;
  return {{"type", light.placed ? "Point" : "Directional"},
          {"position", unity(light.placed ? vec_cast<float>(light.position) : Vec3f{})},
          {"forward", unity(forward)},
          {"color", {std::max(r, 0.0F) / largest, std::max(g, 0.0F) / largest, std::max(b, 0.0F) / largest}},
          {"intensity", largest * std::numbers::inv_pi_v<float>}};
}

/// Writes the arrays, of which each has one row a probe.
class ArrayWriter {
 public:
  explicit ArrayWriter(std::ofstream& file) : file_(file) {}

  template <class Values>
  void write(std::string_view name, const std::vector<GridProbe>& probes, Values&& values_of) {
    text_.assign(",\n\"").append(name).append("\":[");
    bool first = true;
    for (std::size_t i = 0; i < probes.size(); ++i) {
      for (const auto value : values_of(i)) {
        if (!std::exchange(first, false)) text_ += ',';
        char digits[32];
        const auto end = std::to_chars(digits, digits + sizeof digits, value);
        text_.append(digits, end.ptr);
      }
      text_ += '\n';
      if (text_.size() > 65536) flush();
    }
    text_ += ']';
    flush();
  }

 private:
  void flush() {
    file_ << text_;
    text_.clear();
  }

  std::ofstream& file_;
  std::string text_;
};

}  // namespace

Result<PointGrid> PointGrid::with_spacing(Vec3d from, Vec3d to, double spacing_m) {
  constexpr double kFar_m = 1e6;  // Engines have single precision.
  for (const double c : {from.x, from.y, from.z, to.x, to.y, to.z})
    if (!(std::abs(c) <= kFar_m))
      return invalid_argument("a corner of the grid is not finite, or farther than 1000 km from the origin");
  if (!(spacing_m > 0) || !std::isfinite(spacing_m))
    return invalid_argument("the spacing of the grid must be positive, in metres");
  PointGrid out{from, to, {}};
  double all = 1;
  const std::array extents{to.x - from.x, to.y - from.y, to.z - from.z};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double extent = extents[axis];
    if (extent < 0)
      return invalid_argument(
          formatted("the grid ends below its beginning along %c: exchange the two numbers", "xyz"[axis]));
    // A quotient that rounding has raised above a whole number counts as that number.
    const double count = std::ceil(extent / spacing_m * (1 - 1e-12)) + 1;
    all *= count;
    if (!(all <= static_cast<double>(kMaxGridPoints))) break;
    out.counts[axis] = static_cast<std::uint32_t>(count);
  }
  if (!(all <= static_cast<double>(kMaxGridPoints)))
    return Status(
        StatusCode::resource_exhausted,
        formatted("the grid has more than %zu points: make the spacing larger or the box smaller", kMaxGridPoints));
  return out;
}

bool is_even(const FieldLight& light) {
  double square = 0;
  for (const Irradiance& g : light.intensity_gradient) {
    const auto luminance = static_cast<double>(g.luminance());
    square += luminance * luminance;
  }
  return !light.placed || std::sqrt(square) <= 0.1 * static_cast<double>(light.intensity.luminance());
}

Status write_field_grid(const LightField& field, HostTime now, const PointGrid& grid, GridLights lights,
                        const std::string& path) {
  const auto state = field.state();
  if (field.at(grid.from, now).light.validity() == Validity::none)
    return {StatusCode::failed_precondition, path + ": the field has no probe whose light it could write"};
  ordered_json light_list = ordered_json::array();
  std::vector<std::uint32_t> apart;
  if (lights == GridLights::apart)
    for (const FieldLight& light : state->lights) {
      if (!is_even(light)) continue;
      apart.push_back(light.id);
      light_list.push_back(json_of(light));
    }

  std::vector<GridProbe> probes;
  probes.reserve(grid.size());
  std::vector<Vec3d> points;
  std::vector<FieldAnswer> answers;
  while (probes.size() < grid.size()) {
    points.clear();
    for (std::size_t i = probes.size(); i < grid.size() && points.size() < kBatch; ++i)
      points.push_back(point_of(grid, i));
    answers.resize(points.size());
    (void)field.at(points, now, answers);
    for (const FieldAnswer& answer : answers) probes.push_back(probe_of(answer, apart));
  }

  const auto step = [&](double from, double to, std::uint32_t n) { return n > 1 ? (to - from) / (n - 1) : 0.0; };
  const ordered_json head{{"format", "lightwell.unity_grid"},
                          {"version", 1},
                          {"units", state->units == Units::absolute ? "absolute" : "relative"},
                          {"counts", grid.counts},
                          {"origin", unity(Vec3d{grid.from.x, grid.from.y, grid.to.z})},
                          {"spacing",
                           {step(grid.from.x, grid.to.x, grid.counts[0]), step(grid.from.y, grid.to.y, grid.counts[1]),
                            step(grid.from.z, grid.to.z, grid.counts[2])}},
                          {"lights", std::move(light_list)}};
  std::ofstream file(path, std::ios::binary);
  std::string text = json_text(head);
  text.pop_back();  // The closing brace: the arrays follow.
  file << text;
  ArrayWriter writer(file);
  writer.write("positions", probes, [&](std::size_t i) { return unity(point_of(grid, i)); });
  writer.write("validity", probes, [&](std::size_t i) { return std::array{probes[i].has_light ? 1 : 0}; });
  writer.write("flags", probes, [&](std::size_t i) { return std::array{probes[i].flags}; });
  writer.write("bound", probes, [&](std::size_t i) { return std::array{probes[i].bound}; });
  writer.write("residual", probes, [&](std::size_t i) { return std::array{probes[i].residual}; });
  writer.write("sphericalHarmonicsL2", probes, [&](std::size_t i) { return probes[i].light.sphericalHarmonicsL2; });
  file << "}\n";
  if (!file.flush()) return {StatusCode::unavailable, path + " cannot be written"};
  return {};
}

}  // namespace lightwell::tool
