#include "host_sdk/reflection_scenes.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <random>

#include <lightwell/plane_codec.hpp>
#include <lightwell/quantile.hpp>

#include "host_sdk/shadow_scenes.hpp"
#include "support/captured_planes.hpp"

namespace lightwell::test {
namespace {

using reference::V3;

constexpr double kEyeDistance_m = 0.6;
constexpr HostTime kReceived{1'000'000'000};

reference::Rgb radiance_at(const V3& p) {
  const double a = std::sin(150 * p.x + 40 * p.z), b = std::sin(130 * p.y + 1), c = std::sin(140 * p.z + 2);
  return {1 + 0.9 * a * b, 1 + 0.9 * b * c, 1 + 0.9 * c * a};
}

reference::Rgb room_radiance(const V3& d) {
  // The window is before the eye, where its mirror image is seen.
  const double elevation = std::asin(std::clamp(d.z, -1.0, 1.0)), azimuth = std::atan2(d.x, d.y);
  const bool window = std::abs(elevation - 0.7) < 0.35 && std::abs(azimuth + 0.2) < 0.35;
  const double value = 0.5 + 0.4 * d.x + (window ? 4.5 : 0);
  return {value, value, 1.2 * value};
}

}  // namespace

PlaneAppearance received_plane(const CapturedPlane& plane, ImageRecipients images) {
  PlaneEncoder encoder(PlaneEncoderOptions{.images = images});
  PlaneReader reader;
  const auto messages = encoder.encode(plane, plane.info.mid_exposure);
  if (!messages.ok()) return {};
  for (const auto& bytes : *messages)
    if (!reader.take(bytes, kReceived).ok()) return {};
  return reader.snapshot(kReceived);
}

PlaneAppearance glossy_plane(std::optional<float> alpha, std::optional<float> f0) {
  CapturedPlane plane = linear_plane();
  plane.info.gloss_alpha = alpha;
  plane.info.f0 = f0;
  return received_plane(plane);
}

ReflectionCase make_reflection_case(const ReflectionCaseOptions& options) {
  ReflectionCase out;
  out.name = options.name;
  out.gloss.alpha = options.alpha;
  out.scene.room = room_radiance;
  out.plane = glossy_plane(static_cast<float>(options.alpha));
  out.scene.mesh = make_shadow_object(options.object, options.triangles, options.seed);
  const double elevation = options.elevation_deg * std::numbers::pi / 180;
  // From -Y, a little from the side.
  out.eye =
      Vec3d{0.3 * std::cos(elevation), -std::sqrt(0.91) * std::cos(elevation), std::sin(elevation)} * kEyeDistance_m;
  for (const V3& p : out.scene.mesh.positions) {
    const reference::Rgb radiance = radiance_at(p);
    out.scene.radiance.push_back(radiance);
    out.radiance.push_back(
        {static_cast<float>(radiance[0]), static_cast<float>(radiance[1]), static_cast<float>(radiance[2])});
    out.positions.push_back({static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)});
  }
  for (const auto& t : out.scene.mesh.triangles) out.indices.insert(out.indices.end(), t.begin(), t.end());
  return out;
}

std::vector<ReflectionCaseOptions> reflection_cases(int triangles) {
  std::vector<ReflectionCaseOptions> out;
  std::uint64_t seed = 1;
  for (const std::string object : {"standing", "hovering", "chair"})
    for (const double alpha : {0.03, 0.1, 0.2})
      for (const double elevation : {60.0, 30.0, 10.0}) {
        const std::string name = object + ", alpha " + std::to_string(alpha).substr(0, 4) + ", eye at " +
                                 std::to_string(static_cast<int>(elevation)) + " deg";
        out.push_back({name, object, alpha, elevation, triangles, seed++});
      }
  return out;
}

reference::PlaneRectangle rectangle_of(const PlaneGrid& grid, int column, int row) {
  const double w = grid.width_m / grid.columns, h = grid.height_m / grid.rows;
  const double left = grid.centre.x - grid.width_m / 2 + column * w, top = grid.centre.y + grid.height_m / 2 - row * h;
  return {left, top - h, left + w, top};
}

std::vector<TracedReflectionTexel> trace_reflection(const ReflectionCase& test_case, const PlaneGrid& grid, int count,
                                                    int rays) {
  const reference::ReflectionTracer tracer(test_case.scene, test_case.gloss);
  const V3 eye{test_case.eye.x, test_case.eye.y, test_case.eye.z};
  std::mt19937_64 random(3);
  std::uniform_int_distribution<int> columns(0, grid.columns - 1), rows(0, grid.rows - 1);
  std::vector<TracedReflectionTexel> out;
  // A few rays tell whether the object is seen in more than some percent of the lobe.
  constexpr int kTrial = 64;
  for (int trial = 0; trial < 100 * count && static_cast<int>(out.size()) < count; ++trial) {
    TracedReflectionTexel texel{columns(random), rows(random), {}, {}};
    const reference::PlaneRectangle where = rectangle_of(grid, texel.column, texel.row);
    if (tracer.reflection(where, eye, kTrial).hidden < 0.03 && tracer.mirror(where, eye, 4).hidden == 0) continue;
    const V3 middle{(where.left + where.right) / 2, (where.bottom + where.top) / 2, 0};
    if (tracer.hides(middle, eye)) continue;
    texel.blurred = tracer.reflection(where, eye, rays);
    texel.sharp = tracer.mirror(where, eye, std::max(rays / 16, 1));
    out.push_back(texel);
  }
  return out;
}

ReflectionErrors reflection_errors(const std::vector<TracedReflectionTexel>& truth, const PlaneGrid& grid,
                                   const std::vector<Radiance>& reflected, const std::vector<float>& hidden) {
  ReflectionErrors out;
  std::vector<double> errors;
  double power = 0, room_power = 0;
  for (const TracedReflectionTexel& texel : truth) {
    const std::size_t at = static_cast<std::size_t>(texel.row) * static_cast<std::size_t>(grid.columns) +
                           static_cast<std::size_t>(texel.column);
    for (int c = 0; c < 3; ++c) {
      const auto k = static_cast<std::size_t>(c);
      const double error = double{reflected[at][c]} - texel.blurred.object[k];
      errors.push_back(std::abs(error));
      out.rms += error * error;
      out.sharp_rms += std::pow(texel.sharp.object[k] - texel.blurred.object[k], 2);
      power += std::pow(texel.blurred.object[k], 2);
    }
    const double room = texel.blurred.whole_room[1];
    out.room_rms += std::pow(room * (1 - double{hidden[at]}) - texel.blurred.room[1], 2);
    out.sharp_room_rms += std::pow(room * (1 - texel.sharp.hidden) - texel.blurred.room[1], 2);
    room_power += room * room;
    out.hidden_rms += std::pow(double{hidden[at]} - texel.blurred.hidden, 2);
    out.sharp_hidden_rms += std::pow(texel.sharp.hidden - texel.blurred.hidden, 2);
  }
  if (truth.empty()) return out;
  const auto texels = static_cast<double>(truth.size());
  out.percentile_99 = upper_quantile(errors, 0.99) / std::sqrt(power / (3 * texels));
  out.rms = std::sqrt(out.rms / power);
  out.sharp_rms = std::sqrt(out.sharp_rms / power);
  out.room_rms = std::sqrt(out.room_rms / room_power);
  out.sharp_room_rms = std::sqrt(out.sharp_room_rms / room_power);
  out.hidden_rms = std::sqrt(out.hidden_rms / texels);
  out.sharp_hidden_rms = std::sqrt(out.sharp_hidden_rms / texels);
  return out;
}

}  // namespace lightwell::test
