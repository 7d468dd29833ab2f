// Tests the selection and the sampling of faces on a synthetic image of a dodecahedron: white except for the tags'
// black borders.
#include "estimate/marker/sampler.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "calibration/model/lens_table.hpp"

namespace lightwell::marker {
namespace {

constexpr double kDegree = std::numbers::pi / 180, kCell = 0.003;
/// Radiance of the ink beside paper of radiance 1 and albedo 0.8: an albedo of 0.04.
constexpr double kInkRadiance = 0.05;

struct Picture {
  int width = 400, height = 300;
  double focal_px = 700;
};
/// In it a cell of a tag is 9 pixels wide: enough for samples of the ink.
constexpr Picture kLarge = {800, 600, 1400};

RigParameters pinhole(const Picture& picture) {
  LensParameters lens;
  lens.width = picture.width;
  lens.height = picture.height;
  MeiParameters model;
  model.fx = model.fy = picture.focal_px;
  model.cx = (picture.width - 1) / 2.0;
  model.cy = (picture.height - 1) / 2.0;
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
  explicit SampledScene(const Picture& picture = {})
      : width_(picture.width),
        height_(picture.height),
        rig_(pinhole(picture)),
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
    return sample(picture(occluded, {}), max_faces);
  }
  /// `specular`: radiance that is added to ink and paper, by face. `blur_px`: standard deviation of a Gaussian;
  /// `believed_blur_px`: the value given to the sampler.
  [[nodiscard]] Sampled sample_glossy(const std::map<int, double>& specular, double blur_px,
                                      double believed_blur_px) const {
    const std::vector<float> pixels = picture({}, specular);
    return sample(blur_px > 0 ? blur(pixels, blur_px) : pixels, 0, believed_blur_px);
  }
  /// Distance of a point's pixel from the body's outline, px; negative where the body hides it.
  [[nodiscard]] double distance_from_body(Vec3d point) const {
    ConvexHull2d outline;
    for (const Vec3d& p : posed_body_.hull()) outline.add(posed_body_.pixel_of(p)->x, posed_body_.pixel_of(p)->y);
    EXPECT_TRUE(outline.close());
    const PixelPosition pixel = *posed_body_.pixel_of(point);
    return outline.signed_distance(pixel.x, pixel.y);
  }
  /// Largest distance of a point of the body from its centre, m.
  [[nodiscard]] double radius() const {
    double out = 0;
    for (const Vec3d& p : posed_body_.hull()) out = std::max(out, length(p));
    return out;
  }

 private:
  [[nodiscard]] Sampled sample(const std::vector<float>& pixels, int max_faces, double blur_px = 0) const {
    Frame frame;
    frame.info.exposure_s = 1;
    frame.add_view({0, PixelFormat::rgb_f32, width_, height_, packed_stride(PixelFormat::rgb_f32, width_),
                    std::as_bytes(std::span(pixels))});
    estimate::RowReader reader(rig_);
    EXPECT_TRUE(reader.bind(std::span(&frame, 1)).ok());
    SamplerOptions options;
    options.max_faces = max_faces;
    Sampled out;
    out.counts = MarkerSampler(width_, options)
                     .sample(reader, 0, width_, height_, body_, posed_body_, 1, blur_px, 3, out.shading);
    return out;
  }

  [[nodiscard]] std::vector<float> blur(const std::vector<float>& pixels, double sigma_px) const {
    const int reach = static_cast<int>(std::ceil(4 * sigma_px));
    std::vector<float> out = pixels, across(pixels.size());
    for (const auto& [dx, dy] : {std::pair{1, 0}, {0, 1}}) {
      across = out;
      for (int y = 0; y < height_; ++y)
        for (int x = 0; x < width_; ++x)
          for (int c = 0; c < 3; ++c) {
            double sum = 0, weights = 0;
            for (int k = -reach; k <= reach; ++k) {
              const int from_x = std::clamp(x + k * dx, 0, width_ - 1), from_y = std::clamp(y + k * dy, 0, height_ - 1);
              const double weight = std::exp(-0.5 * k * k / (sigma_px * sigma_px));
              sum += weight * across[static_cast<std::size_t>(3 * (from_y * width_ + from_x) + c)], weights += weight;
            }
            out[static_cast<std::size_t>(3 * (y * width_ + x) + c)] = static_cast<float>(sum / weights);
          }
    }
    return out;
  }

  [[nodiscard]] std::vector<float> picture(const std::set<int>& occluded, const std::map<int, double>& specular) const {
    std::vector<float> out(static_cast<std::size_t>(3 * width_ * height_), 1);
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
      const auto gloss = specular.find(static_cast<int>(hit));
      const double light = (off > 3 && off < 4 && !occluded.contains(static_cast<int>(hit)) ? kInkRadiance : 1) +
                           (gloss != specular.end() ? gloss->second : 0);
      for (std::size_t c = 0; c < 3; ++c) out[3 * i + c] = static_cast<float>(light);
    }
    return out;
  }

  int width_, height_;
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

TEST(MarkerSampler, APatchHasItsNumberWhateverElseIsSampled) {
  const SampledScene scene;
  const Shading all = scene.sample(0).shading, two = scene.sample(2).shading;
  std::map<int, Vec3d> places;
  for (const SurfaceSample& s : all.samples)
    EXPECT_TRUE(places.emplace(s.patch, s.position).second) << s.patch << " is the number of two patches";
  ASSERT_LT(two.samples.size(), all.samples.size());
  for (const SurfaceSample& s : two.samples) {
    ASSERT_TRUE(places.contains(s.patch)) << s.patch;
    EXPECT_LT(length(s.position - places.at(s.patch)), 1e-9) << s.patch;
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

TEST(MarkerSampler, SpecularRadianceOfAFaceIsSubtracted) {
  const SampledScene scene(kLarge);
  const std::vector<int> seen = scene.faces_seen();
  for (const bool blurred : {false, true}) {
    const SampledScene::Sampled matte = scene.sample_glossy({}, blurred ? 1 : 0, 1);
    ASSERT_GE(matte.shading.ink.size(), 3U) << blurred;
    for (const InkSample& ink : matte.shading.ink) {
      // Float pixels; of a blur of 1 px, at most Q(2.5) = 0.6 % of the white arrives at the ink's margin.
      EXPECT_NEAR(ink.radiance, kInkRadiance, blurred ? 0.006 : 1e-6) << "face " << ink.surface;
      EXPECT_NEAR(ink.paper_albedo, 0.8, 1e-9);
    }
    for (const InkSample& ink : matte.shading.ink) {
      const SampledScene::Sampled glossy = scene.sample_glossy({{ink.surface, 0.1}}, blurred ? 1 : 0, 1);
      ASSERT_EQ(glossy.shading.samples.size(), matte.shading.samples.size()) << blurred;
      for (std::size_t i = 0; i < matte.shading.samples.size(); ++i) {
        const SurfaceSample &with = glossy.shading.samples[i], &without = matte.shading.samples[i];
        if (with.surface != ink.surface &&
            std::ranges::find(matte.shading.ink, with.surface, &InkSample::surface) == matte.shading.ink.end())
          continue;
        // The specular part is 11 % of the irradiance. With blur, its share is known within 0.6 %.
        EXPECT_NEAR(with.irradiance[1] / without.irradiance[1], 1, blurred ? 0.006 : 1e-5)
            << "gloss on face " << ink.surface << ", face " << with.surface << ", blurred " << blurred;
        if (with.surface != ink.surface) continue;
        EXPECT_GT(with.sigma[1], without.sigma[1] + 0.06 * without.irradiance[1]) << "face " << with.surface;
      }
    }
  }
}

TEST(MarkerSampler, MarginsGrowWithTheBlur) {
  const SampledScene scene(kLarge);
  constexpr double kBlur_px = 1.4;
  const SampledScene::Sampled unaware = scene.sample_glossy({}, kBlur_px, 0),
                              aware = scene.sample_glossy({}, kBlur_px, kBlur_px);
  ASSERT_FALSE(aware.shading.ink.empty());
  double most = 0;
  for (const InkSample& ink : unaware.shading.ink) most = std::max(most, ink.radiance);
  EXPECT_GT(most, kInkRadiance + 0.015) << "2.5 px from the white, Q(2.5 / 1.4) = 3.7 % of it arrive";
  // As with a blur of 1 px and its margin: at most Q(2.5) = 0.6 % from each of the two sides.
  for (const InkSample& ink : aware.shading.ink) EXPECT_NEAR(ink.radiance, kInkRadiance, 0.012) << ink.surface;
}

TEST(MarkerSampler, WithoutPixelsInsideTheInkFacesKeepTheirIrradiance) {
  const SampledScene scene(Picture{400, 300, 500});  // cells are 4 pixels wide, less than twice the margin
  const SampledScene::Sampled glossy = scene.sample_glossy({{scene.faces_seen()[0], 0.1}}, 0, 0);
  EXPECT_TRUE(glossy.shading.ink.empty());
  for (const SurfaceSample& s : glossy.shading.samples)
    EXPECT_NEAR(s.irradiance[1], std::numbers::pi / 0.8 * (s.surface == scene.faces_seen()[0] ? 1.1 : 1), 1e-4);
}

/// Column and row of a ground sample on the grid below the body's centre, in steps.
std::pair<double, double> on_grid(const GroundPlane& ground, const GroundSample& sample) {
  const auto [u, v] = tangent_basis(ground.normal);
  return {dot(sample.position, u) / ground.step_m, dot(sample.position, v) / ground.step_m};
}

TEST(MarkerSampler, SamplesTheGroundMoreDenselyWhereLittleOfItIsSeen) {
  const auto ground_at = [](double focal_px) {
    return *SampledScene(Picture{400, 300, focal_px}).sample(1).shading.ground;
  };
  // 400 samples in the circle around the body, of which the body and the edges of the picture hide some.
  const double usual = 3.4 * SampledScene().radius() * std::sqrt(std::numbers::pi / 400);
  int denser = 0;
  for (const double focal_px : {250.0, 350.0, 500.0, 700.0, 900.0, 1100.0}) {
    const GroundPlane ground = ground_at(focal_px);
    const double factor = ground.step_m / usual, seen = static_cast<double>(ground.samples.size());
    EXPECT_NEAR(ground.density * factor * factor, 1, 1e-9) << focal_px;
    EXPECT_GE(factor, 0.4 - 1e-9) << focal_px;
    EXPECT_LE(factor, 1 + 1e-9) << focal_px;
    if (factor > 1 - 1e-9) {
      EXPECT_GE(seen, 300) << focal_px;
    } else if (factor > 0.4 + 1e-9) {
      ++denser;
      // Finer samples also fit into narrower gaps, and samples that are seen in part are added to 250 whole ones.
      EXPECT_GE(seen, 290) << focal_px;
      EXPECT_LE(seen, 480) << focal_px;
    }
    // At most one in each square of the grid.
    std::set<std::pair<long, long>> squares;
    for (const GroundSample& sample : ground.samples) {
      const auto [column, row] = on_grid(ground, sample);
      EXPECT_TRUE(squares.insert({std::lround(column), std::lround(row)}).second) << focal_px;
    }
  }
  EXPECT_GE(denser, 1) << "no picture hides most of the plane";
}

TEST(MarkerSampler, SamplesTheGroundBesideTheBodyWhereItIsSeenInPart) {
  const SampledScene scene;
  const GroundPlane ground = *scene.sample(0).shading.ground;
  int whole = 0, in_part = 0;
  for (const GroundSample& sample : ground.samples) {
    const auto [column, row] = on_grid(ground, sample);
    const double off = std::hypot(column - std::round(column), row - std::round(row));
    (off < 1e-6 ? whole : in_part) += 1;
    // Half of the square's points or more: their middle is at most a quarter of its side off, along a diagonal 1/4.
    EXPECT_LT(off, 0.36);
    EXPECT_GT(scene.distance_from_body(sample.position), 3) << "a point that is hidden, or mixed with the body";
  }
  EXPECT_GT(whole, 100);
  EXPECT_GT(in_part, 20) << "all around the body's outline";
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
