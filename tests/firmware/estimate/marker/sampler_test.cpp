// Tests the selection and the sampling of faces on a synthetic image of a dodecahedron: white except for the tags'
// black borders.
#include "estimate/marker/sampler.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "calibration/model/lens_table.hpp"

namespace lightwell::marker {
namespace {

constexpr int kWidth = 400, kHeight = 300;
constexpr double kDegree = std::numbers::pi / 180, kCell = 0.003;

RigParameters pinhole() {
  LensParameters lens;
  lens.width = kWidth;
  lens.height = kHeight;
  MeiParameters model;
  model.fx = model.fy = 700;
  model.cx = (kWidth - 1) / 2.0;
  model.cy = (kHeight - 1) / 2.0;
  lens.model = model;
  lens.max_angle_rad = 1.2;
  lens.pose_cv = {upright_lens_cv(), {}};
  RigParameters rig;
  rig.lenses = {lens};
  return rig;
}

TEST(SphereCoverage, IsTheSolidAngleOfHemispheres) {
  constexpr double kSum = 0.002;
  const auto coverage = [](const std::vector<VisibleSurface>& surfaces) { return sphere_coverage(surfaces).coverage; };
  EXPECT_EQ(coverage({}), 0);
  EXPECT_NEAR(coverage({{{0, 0, 1}}}), 0.5, kSum);
  EXPECT_NEAR(coverage({{{0, 0, 1}}, {{0, 0, 1}}}), 0.5, kSum) << "one hemisphere counts once";
  EXPECT_NEAR(coverage({{{0, 0, 1}}, {{0, 0, -1}}}), 1, kSum);
  EXPECT_NEAR(coverage({{{1, 0, 0}}, {{0, 0, 1}}}), 0.75, kSum) << "all but a lune of 90 degrees";
  EXPECT_NEAR(coverage({{{1, 0, 0}}, {{0, 1, 0}}, {{0, 0, 1}}}), 0.875, kSum) << "all but an octant";
}

TEST(SphereCoverage, SaturatedDirectionsLightNoUsableSurface) {
  constexpr double kSum = 0.004;
  const auto saturated = [](const std::vector<VisibleSurface>& surfaces) {
    return sphere_coverage(surfaces).saturated;
  };
  EXPECT_EQ(saturated({}), 0);
  EXPECT_EQ(saturated({{{0, 0, 1}, false}}), 0);
  EXPECT_EQ(saturated({{{0, 0, 1}, true}}), 1);
  EXPECT_NEAR(saturated({{{0, 0, 1}, true}, {{0, 0, -1}, false}}), 0.5, kSum);
  EXPECT_NEAR(saturated({{{0, 0, 1}, true}, {{1, 0, 0}, false}}), 1.0 / 3, kSum) << "a lune of three";
}

/// A dodecahedron at a distance of 45 cm, seen from above, rotated so that all viewing angles of faces differ.
class SampledScene {
 public:
  SampledScene()
      : rig_(pinhole()),
        table_(*make_rig_table(rig_)),
        model_(rig_.lenses[0]),
        body_(*load_marker_body(LIGHTWELL_MARKER_BODIES "/dodecahedron_100mm_white.textproto")),
        pose_{Quat::about({1, 0, 0}, 27 * kDegree) * Quat::about({0, 1, 0}, 10 * kDegree), {0.01, 0, -0.45}},
        posed_body_(body_, rig_.lenses[0], model_, pose_) {}

  /// Faces with a cosine of the viewing angle above 0.17 (10 degrees above the face), in descending order.
  [[nodiscard]] std::vector<int> faces_seen() const {
    std::vector<std::pair<double, int>> seen;
    for (std::size_t f = 0; f < body_.faces.size(); ++f) {
      const Pose face = compose(pose_, body_.faces[f].body_face);
      const double view_cosine = -dot(normalized(face.translation), rotate(face.rotation, Vec3d{0, 0, 1}));
      if (view_cosine > 0.17) seen.emplace_back(-view_cosine, static_cast<int>(f));
    }
    std::sort(seen.begin(), seen.end());
    std::vector<int> out;
    for (const auto& [view_cosine, f] : seen) out.push_back(f);
    return out;
  }

  struct Sampled {
    Shading shading;
    SampleCounts counts;
    [[nodiscard]] std::set<int> faces() const {
      std::set<int> out;
      for (const SurfaceSample& s : shading.samples) out.insert(s.surface);
      return out;
    }
  };
  /// Tag borders of the faces in `occluded` are not drawn: something white occludes these faces.
  [[nodiscard]] Sampled sample(int max_faces, const std::set<int>& occluded = {}) const {
    const std::vector<float> pixels = picture(occluded);
    Frame frame;
    frame.info.exposure_s = 1;
    frame.add_view({0, PixelFormat::rgb_f32, kWidth, kHeight, packed_stride(PixelFormat::rgb_f32, kWidth),
                    std::as_bytes(std::span(pixels))});
    estimate::RowReader reader(rig_);
    EXPECT_TRUE(reader.bind(std::span(&frame, 1)).ok());
    SamplerOptions options;
    options.max_faces = max_faces;
    Sampled out;
    out.counts =
        MarkerSampler(kWidth, options).sample(reader, 0, kWidth, kHeight, body_, posed_body_, 1, 3, out.shading);
    return out;
  }

 private:
  [[nodiscard]] std::vector<float> picture(const std::set<int>& occluded) const {
    std::vector<float> out(static_cast<std::size_t>(3 * kWidth * kHeight), 1);
    const Pose body_probe = inverse(pose_);
    const Vec3d from = body_probe.translation;
    for (std::size_t i = 0; i < table_.lenses[0].direction.size(); ++i) {
      const Vec3d ray = rotate(body_probe.rotation, vec_cast<double>(table_.lenses[0].direction[i]));
      // A ray enters a convex solid at the last of the front-facing planes, if at all.
      double at = 0;
      std::size_t hit = 0;
      for (std::size_t f = 0; f < body_.faces.size(); ++f) {
        const Vec3d normal = rotate(body_.faces[f].body_face.rotation, Vec3d{0, 0, 1});
        if (dot(ray, normal) >= 0) continue;
        const double t = dot(body_.faces[f].body_face.translation - from, normal) / dot(ray, normal);
        if (t > at) at = t, hit = f;
      }
      const Vec3d p = transformed(inverse(body_.faces[hit].body_face), from + ray * at);
      const double off = std::max(std::abs(p.x), std::abs(p.y)) / kCell;
      if (off > 3 && off < 4 && !occluded.contains(static_cast<int>(hit)))
        for (std::size_t c = 0; c < 3; ++c) out[3 * i + c] = 0.05F;
    }
    return out;
  }

  RigParameters rig_;
  RigTable table_;
  CameraModel model_;
  MarkerBody body_;
  Pose pose_;
  PosedBody posed_body_;
};

std::set<int> first(const std::vector<int>& faces, std::size_t count) {
  return {faces.begin(), faces.begin() + static_cast<std::ptrdiff_t>(count)};
}

TEST(MarkerSampler, SamplesTheFacesThatFaceTheLensMost) {
  const SampledScene scene;
  const std::vector<int> seen = scene.faces_seen();
  ASSERT_GE(seen.size(), 4U);
  for (std::size_t most = 1; most <= seen.size(); ++most) {
    const SampledScene::Sampled sampled = scene.sample(static_cast<int>(most));
    EXPECT_EQ(sampled.faces(), first(seen, most)) << most;
    EXPECT_EQ(sampled.counts.faces, static_cast<int>(most));
  }
}

TEST(MarkerSampler, WithoutALimitSamplesAllVisibleFacesInOrder) {
  const SampledScene scene;
  const std::vector<int> seen = scene.faces_seen();
  const SampledScene::Sampled all = scene.sample(0), twelve = scene.sample(12);
  EXPECT_EQ(all.faces(), first(seen, seen.size()));
  EXPECT_TRUE(std::is_sorted(all.shading.samples.begin(), all.shading.samples.end(),
                             [](const SurfaceSample& a, const SurfaceSample& b) { return a.surface < b.surface; }));
  ASSERT_EQ(all.shading.samples.size(), twelve.shading.samples.size());
  for (std::size_t i = 0; i < all.shading.samples.size(); ++i) {
    EXPECT_EQ(all.shading.samples[i].surface, twelve.shading.samples[i].surface) << i;
    EXPECT_EQ(all.shading.samples[i].irradiance, twelve.shading.samples[i].irradiance) << i;
  }
}

TEST(MarkerSampler, IrradianceIsPiTimesRadianceOverAlbedo) {
  for (const SurfaceSample& s : SampledScene().sample(0).shading.samples)
    for (const double e : s.irradiance)
      EXPECT_NEAR(e, std::numbers::pi / 0.8, 1e-4) << "the body's albedo is 0.8, the radiance 1";
}

TEST(MarkerSampler, SamplesTheGroundForAnyNumberOfFaces) {
  const SampledScene scene;
  const SampledScene::Sampled all = scene.sample(0), one = scene.sample(1);
  ASSERT_TRUE(all.shading.ground && one.shading.ground);
  ASSERT_GT(all.shading.ground->samples.size(), 30U);
  ASSERT_EQ(all.shading.ground->samples.size(), one.shading.ground->samples.size());
  for (std::size_t i = 0; i < all.shading.ground->samples.size(); ++i)
    EXPECT_EQ(all.shading.ground->samples[i].radiance, one.shading.ground->samples[i].radiance) << i;
}

TEST(MarkerSampler, ReplacesAnOccludedFaceByTheNext) {
  const SampledScene scene;
  const std::vector<int> seen = scene.faces_seen();
  const SampledScene::Sampled sampled = scene.sample(2, {seen[0]});
  EXPECT_EQ(sampled.faces(), (std::set<int>{seen[1], seen[2]}));
  EXPECT_GT(sampled.counts.occluded, 0);
}

}  // namespace
}  // namespace lightwell::marker
