#include "measure/relight_renders.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <numbers>
#include <span>
#include <utility>

#include <lightwell/bytes.hpp>
#include <lightwell/files.hpp>

namespace lightwell::measure {
namespace {

using reference::LightPattern;
using reference::TracedLight;
using reference::V3;

/// Distance of the lights from the subject, whose radius is about 1 m.
constexpr double kLightDistance_m = 4;
/// A white matte surface that faces a light at this distance shows radiance 1.
constexpr double kIntensity = std::numbers::pi * kLightDistance_m * kLightDistance_m;
constexpr double kEye_m = 6, kHalfWidth_m = 1.45;
constexpr int kTexels = 1024, kTexelSamples = 2;
/// Tangent of half of the angle across the patterns: blinds reach all of the subject, stained glass a part of it.
constexpr double kBlindsTan = 0.28, kGlassTan = 0.17;

V3 light_place(const V3& direction) { return kLightDistance_m * reference::normalised(direction); }

/// The basis light that is nearest to a direction.
V3 basis_place(const V3& direction) {
  const auto directions = reference::fibonacci_normals(static_cast<int>(kBasisLights));
  return light_place(
      *std::ranges::max_element(directions, {}, [&](const V3& d) { return reference::dot(d, direction); }));
}

PatternCase pattern_case(const std::string& name, LightPattern pattern, const V3& place, const V3& aim) {
  const double tangent = pattern == LightPattern::blinds ? kBlindsTan : kGlassTan;
  return {name, {place, {kIntensity, kIntensity, kIntensity}, pattern, aim, tangent}};
}

Vec3d vector_of(const V3& v) { return {v.x, v.y, v.z}; }

/// The pose of a light at a place that looks at a point, with +Y up in its picture.
Pose looking_at(Vec3d place, Vec3d aim) {
  const Vec3d back = normalized(place - aim), right = normalized(cross(Vec3d{0, 1, 0}, back)), up = cross(back, right);
  // The quaternion of the matrix with these columns (Shepperd 1978); its trace is above -1 for lights in front.
  const double w = 0.5 * std::sqrt(1 + right.x + up.y + back.z), k = 0.25 / w;
  return {Quat{k * (up.z - back.y), k * (back.x - right.z), k * (right.y - up.x), w}.normalized(), place};
}

std::vector<Radiance> radiances(const std::vector<std::array<float, 3>>& in) {
  std::vector<Radiance> out;
  out.reserve(in.size());
  for (const auto& p : in) out.push_back({p[0], p[1], p[2]});
  return out;
}

reference::TracedCamera traced_camera(const RelightRenderSize& size) {
  return {size.columns, size.rows, 0.5 * size.columns * kEye_m / kHalfWidth_m, {0, 0, kEye_m}};
}

RelightRenders render(const reference::PathTracer& tracer, const RelightRenderSize& size) {
  std::vector<TracedLight> patterns;
  for (const PatternCase& c : pattern_cases()) patterns.push_back(c.light);
  // Different seeds, so that photographs and truth have independent noise.
  auto basis = tracer.trace(traced_camera(size), traced_basis(), {size.basis_samples, 16, 1, 2});
  const auto truth = tracer.trace(traced_camera(size), patterns, {size.truth_samples, 16, 2, 2});
  RelightRenders out;
  out.coverage = std::move(basis.coverage);
  out.depth_m = std::move(basis.depth);
  for (const auto& a : basis.albedo) out.albedo.push_back({a[0], a[1], a[2]});
  for (const auto& n : basis.normal) out.normals.push_back({n[0], n[1], n[2]});
  for (const auto& picture : basis.light) out.photographs.push_back(radiances(picture));
  for (const auto& picture : truth.light) out.truth.push_back(radiances(picture));
  for (const auto& picture : truth.direct) out.truth_direct.push_back(radiances(picture));
  return out;
}

/// Calls use(memory, bytes) for each array, in the order of the file.
template <class Renders, class Use>
void each_array(Renders& renders, const Use& use) {
  const auto all = [&](auto& values) { use(values.data(), values.size() * sizeof(values[0])); };
  all(renders.coverage);
  all(renders.depth_m);
  all(renders.albedo);
  all(renders.normals);
  for (auto* pictures : {&renders.photographs, &renders.truth, &renders.truth_direct})
    for (auto& picture : *pictures) all(picture);
}

std::uint32_t fingerprint(const reference::PathTracer& tracer) {
  const RelightRenders small = render(tracer, {24, 18, 4, 4});
  std::uint32_t crc = 0;
  each_array(small, [&](const void* data, std::size_t bytes) {
    crc = crc32c(std::span(static_cast<const std::byte*>(data), bytes), crc);
  });
  return crc;
}

RelightRenders empty(std::size_t pixels) {
  RelightRenders out;
  out.coverage.resize(pixels);
  out.depth_m.resize(pixels);
  out.albedo.resize(pixels);
  out.normals.resize(pixels);
  out.photographs.assign(kBasisLights, std::vector<Radiance>(pixels));
  out.truth.assign(pattern_cases().size(), std::vector<Radiance>(pixels));
  out.truth_direct = out.truth;
  return out;
}

}  // namespace

const std::vector<PatternCase>& pattern_cases() {
  static const std::vector<PatternCase> kCases = {
      pattern_case("blinds, at a basis light", LightPattern::blinds, basis_place({0.5, 0.6, 0.7}), {}),
      pattern_case("stained glass, at a basis light", LightPattern::stained_glass, basis_place({-0.7, 0.3, 0.6}),
                   {0.1, -0.1, 0}),
      pattern_case("blinds, between basis lights", LightPattern::blinds, light_place({-0.25, 0.7, 0.75}), {}),
      pattern_case("stained glass, between basis lights", LightPattern::stained_glass, light_place({0.75, 0.25, 0.6}),
                   {0.1, -0.1, 0})};
  return kCases;
}

std::vector<TracedLight> traced_basis() {
  std::vector<TracedLight> out;
  for (const V3& direction : reference::fibonacci_normals(static_cast<int>(kBasisLights)))
    out.push_back({light_place(direction), {kIntensity, kIntensity, kIntensity}, LightPattern::none, {}, 0});
  return out;
}

std::vector<BasisLight> basis_lights() {
  std::vector<BasisLight> out;
  for (const TracedLight& light : traced_basis()) {
    const auto e = static_cast<float>(light.intensity[0]);
    out.push_back({vector_of(light.position), LightDistance::finite, {e, e, e}});
  }
  return out;
}

PatternLight pattern_light(const PatternCase& pattern, std::vector<RgbFactor>& picture) {
  picture.clear();
  for (int row = 0; row < kTexels; ++row)
    for (int column = 0; column < kTexels; ++column) {
      RgbFactor sum;
      for (int s = 0; s < kTexelSamples * kTexelSamples; ++s) {
        const double x = 2 * (column + (s % kTexelSamples + 0.5) / kTexelSamples) / kTexels - 1;
        const double y = 1 - 2 * (row + (s / kTexelSamples + 0.5) / kTexelSamples) / kTexels;
        const reference::Rgb t = reference::transmittance(pattern.light.pattern, x, y);
        sum += {static_cast<float>(t[0]), static_cast<float>(t[1]), static_cast<float>(t[2])};
      }
      picture.push_back(sum * (1.0F / (kTexelSamples * kTexelSamples)));
    }
  PatternLight out;
  out.T_world_light = looking_at(vector_of(pattern.light.position), vector_of(pattern.light.aim));
  out.field_of_view_rad = 2 * std::atan(pattern.light.half_width_tan);
  out.columns = out.rows = kTexels;
  out.picture = picture;
  const auto e = static_cast<float>(pattern.light.intensity[0]);
  out.irradiance = {e, e, e};
  return out;
}

Result<RelightRenders> relight_renders(const RelightRenderSize& size, const std::string& folder) {
  const reference::PathTracer tracer(reference::traced_figurine());
  RelightCamera camera{size.columns, size.rows, traced_camera(size).focal_px, 0.5 * size.columns, 0.5 * size.rows, {}};
  camera.T_world_camera.translation = {0, 0, kEye_m};
  std::string path;
  RelightRenders out = empty(camera.pixels());
  if (!folder.empty()) {
    std::error_code error;
    std::filesystem::create_directories(path_of(folder), error);
    char name[96];
    std::snprintf(name, sizeof name, "/%08x_%dx%d_%d_%d.raw", fingerprint(tracer), size.columns, size.rows,
                  size.basis_samples, size.truth_samples);
    path = folder + name;
    if (const auto file = read_text_file(path); file.ok()) {
      std::size_t at = 0;
      each_array(out, [&](void* data, std::size_t bytes) {
        if (at + bytes <= file->size()) std::memcpy(data, file->data() + at, bytes);
        at += bytes;
      });
      if (at == file->size()) {
        out.camera = camera;
        return out;
      }
    }
  }
  out = render(tracer, size);
  out.camera = camera;
  if (path.empty()) return out;
  std::string bytes;
  each_array(out, [&](const void* data, std::size_t count) { bytes.append(static_cast<const char*>(data), count); });
  if (const Status written = write_atomically(path, bytes, FileMode::umask); !written.ok()) return written;
  return out;
}

}  // namespace lightwell::measure
