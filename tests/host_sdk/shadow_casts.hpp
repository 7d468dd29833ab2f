// Meshes, light and receiver of the tests of ShadowCaster, and a call of it.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <lightwell/shadows.hpp>

#include "host_sdk/shadow_scenes.hpp"
#include "reference/shadow_tracer.hpp"

namespace lightwell::test {

inline constexpr double kDegree = std::numbers::pi / 180;

/// A mesh in the plane's frame, and its light in the same frame.
struct Scene {
  std::vector<Vec3f> positions;
  std::vector<std::uint32_t> indices;
  Lighting lighting;
  ShadowReceiver receiver{{}, 0.32, 0.32, 32, 32};

  [[nodiscard]] Scene with_texels(int side) const {
    Scene out = *this;
    out.receiver.columns = out.receiver.rows = side;
    return out;
  }
  [[nodiscard]] ShadowMesh mesh() const { return {positions, indices, {}}; }
  [[nodiscard]] std::size_t texels() const { return static_cast<std::size_t>(receiver.columns * receiver.rows); }
};

inline Scene scene_of(const reference::TriangleMesh& mesh, const std::vector<reference::ShadowLight>& lights,
                      reference::Rgb residual = {}) {
  Scene out;
  for (const reference::V3& p : mesh.positions)
    out.positions.push_back({static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)});
  for (const auto& t : mesh.triangles) out.indices.insert(out.indices.end(), t.begin(), t.end());
  out.lighting = lighting_of(lights, residual, {});
  return out;
}

inline reference::TriangleMesh quad(reference::V3 a, reference::V3 b, reference::V3 c, reference::V3 d) {
  return {{a, b, c, d}, {{0, 1, 2}, {0, 2, 3}}};
}

/// A horizontal rectangle.
inline reference::TriangleMesh sheet(double left, double bottom, double right, double top, double height) {
  return quad({left, bottom, height}, {right, bottom, height}, {right, top, height}, {left, top, height});
}

inline ShadowCaster make_caster(const ShadowOptions& options = {}) {
  Result<ShadowCaster> made = ShadowCaster::make(options);
  EXPECT_TRUE(made.ok()) << made.status().message();
  return std::move(*made);
}

struct Cast {
  std::vector<LightRatio> ratios;
  Answer<ShadowSummary> answer;

  [[nodiscard]] LightRatio at(const Scene& scene, int column, int row) const {
    return ratios[static_cast<std::size_t>(row * scene.receiver.columns + column)];
  }
};

inline Cast cast(ShadowCaster& caster, const Scene& scene) {
  Cast out;
  out.ratios.assign(scene.texels(), {-1, -1, -1});
  const Result<Answer<ShadowSummary>> answer = caster.cast(scene.lighting, scene.receiver, scene.mesh(), out.ratios);
  EXPECT_TRUE(answer.ok()) << answer.status().message();
  if (answer.ok()) out.answer = *answer;
  for (const LightRatio& r : out.ratios)
    for (int c = 0; c < 3; ++c)
      if (!(r[c] >= 0 && r[c] <= 1)) ADD_FAILURE() << "a ratio is " << r[c];
  return out;
}

inline Cast cast(const Scene& scene, const ShadowOptions& options = {}) {
  ShadowCaster caster = make_caster(options);
  return cast(caster, scene);
}

inline float lowest(const Cast& cast) {
  float out = 1;
  for (const LightRatio& r : cast.ratios) out = std::min({out, r.r, r.g, r.b});
  return out;
}

inline float largest_difference(const Cast& a, const Cast& b) {
  float out = 0;
  for (std::size_t i = 0; i < a.ratios.size(); ++i)
    for (int c = 0; c < 3; ++c) out = std::max(out, std::abs(a.ratios[i][c] - b.ratios[i][c]));
  return out;
}

}  // namespace lightwell::test
