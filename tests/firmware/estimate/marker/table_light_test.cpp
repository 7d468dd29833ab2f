// A descriptor from a marker describes all light that arrives at the body's centre as if the body were absent, the
// table's included: pictures of a body on a bright table, compared with closed forms, from pixels to descriptor.
#include <array>
#include <cmath>
#include <cstddef>
#include <memory>
#include <numbers>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <lightwell/query.hpp>

#include "app/tag_body_finder.hpp"
#include "estimate/marker/marker_estimator.hpp"
#include "reference/marker/marker_picture.hpp"
#include "reference/marker/marker_scene.hpp"
#include "reference/marker/marker_stage.hpp"

namespace lightwell::marker::test {
namespace {

using reference::Rgb;

constexpr double kDegree = std::numbers::pi / 180;
constexpr Rgb kAlbedo = {0.35, 0.35, 0.35};
/// Irradiance of the lamp at power 1, at normal incidence, and of the sky on the table.
constexpr Rgb kLamp = {1, 0.9, 0.75}, kSky = {0.2, 0.22, 0.25};

/// The dodecahedron on an infinite table, below a uniform sky and a distant lamp. The table reflects both to the body:
/// an infinite uniform plane of radiance L gives a surface the irradiance pi L (1 - cos) / 2 by its normal's angle to
/// up, less what the shadow lacks. Light that the body reflects is not modelled.
class TableScene {
 public:
  TableScene(double lamp_azimuth_deg, double lamp_elevation_deg)
      : camera_(reference::pinhole_lens(640, 480, 700)),
        lamp_(stage_.direction(lamp_azimuth_deg * kDegree, lamp_elevation_deg * kDegree)) {
    const Result<MarkerBody> body =
        load_marker_body(std::string(LIGHTWELL_MARKER_BODIES) + "/dodecahedron_100mm_white.textproto");
    EXPECT_TRUE(body) << body.status().message();
    scene_.body = *body;
    scene_.probe_body = stage_.probe_body();
    scene_.table = reference::table_under(*body, scene_.probe_body, body->faces.back().tag_id, kAlbedo);
    const reference::RenderOptions options{.samples = 2, .edge_rays = 34, .blur_px = 0.5};
    scene_.ambient = ambient_of(kSky, kSky);
    of_sky_ = reference::render(scene_, camera_, options).rgb;
    scene_.ambient = ambient_of({}, on_table(1));
    scene_.lamps = {reference::DistantLamp{lamp_, kLamp}};
    of_lamp_ = reference::render(scene_, camera_, options).rgb;
    subtract_shadow_from_table_light();
  }

  /// Irradiance in the body's centre without the body.
  [[nodiscard]] Rgb truth(Vec3d normal, double power) const {
    Rgb out{};
    const double up = dot(normal, stage_.up());
    for (std::size_t c = 0; c < 3; ++c)
      out[c] = kSky[c] * (1 + up) / 2 + kAlbedo[c] * (kSky[c] + on_table(power)[c]) * (1 - up) / 2 +
               power * kLamp[c] * std::max(0.0, dot(normal, lamp_));
    return out;
  }

  /// The estimate from one picture.
  [[nodiscard]] Descriptor estimate(double power) const {
    std::vector<float> pixels = of_sky_;
    for (std::size_t i = 0; i < pixels.size(); ++i) pixels[i] += static_cast<float>(power) * of_lamp_[i];
    Frame frame;
    frame.info.exposure_s = 1;
    frame.add_view({0, PixelFormat::rgb_f32, camera_.width(), camera_.height(),
                    packed_stride(PixelFormat::rgb_f32, camera_.width()), std::as_bytes(std::span(pixels))});
    RigParameters rig;
    rig.lenses = {camera_.lens()};
    Descriptor out;
    Result<std::unique_ptr<BodyFinder>> finder = make_tag_body_finder(rig, scene_.body);
    EXPECT_TRUE(finder) << finder.status().message();
    const auto estimator = make_marker_estimator(rig, scene_.body, std::move(*finder), {});
    EXPECT_TRUE(estimator) << estimator.status().message();
    const Status status = (*estimator)->estimate(std::span(&frame, 1), out);
    EXPECT_TRUE(status.ok()) << status.message();
    return out;
  }

  /// Unit vectors; `within_deg`: of the direction to the camera.
  [[nodiscard]] std::vector<Vec3d> normals(double within_deg) const {
    std::vector<Vec3d> out;
    for (const Vec3d& n : fibonacci_directions(500))
      if (dot(n, normalized(-scene_.probe_body.translation)) >= std::cos(within_deg * kDegree)) out.push_back(n);
    return out;
  }

 private:
  /// Irradiance of the table by the lamp.
  [[nodiscard]] Rgb on_table(double power) const {
    Rgb out{};
    for (std::size_t c = 0; c < 3; ++c) out[c] = power * kLamp[c] * dot(lamp_, stage_.up());
    return out;
  }
  /// Light from above and from a table with the irradiance `table`; bands 0 and 1 give its irradiance exactly.
  [[nodiscard]] reference::MarkerAmbient ambient_of(const Rgb& sky, const Rgb& table) const {
    reference::MarkerAmbient out;
    const Vec3d up = stage_.up();
    const std::array<double, 3> band1 = {up.y, up.z, up.x};
    for (std::size_t c = 0; c < 3; ++c) {
      const double above = sky[c], below = kAlbedo[c] * table[c];
      out.sh[0][c] = (above + below) / 2 / (reference::pi * std::sqrt(1 / (4 * reference::pi)));
      for (std::size_t k = 0; k < 3; ++k)
        out.sh[1 + k][c] =
            (above - below) / 2 * band1[k] / (2 * reference::pi / 3 * std::sqrt(3 / (4 * reference::pi)));
    }
    return out;
  }
  /// The lamp's shadow on the table sends no light to the faces.
  void subtract_shadow_from_table_light() {
    constexpr double kCell = 0.01, kReach = 0.35;  // m
    const Vec3d up = stage_.up();
    const auto [u, v] = tangent_basis(up);
    std::vector<Vec3d> shadow;
    for (double x = -kReach; x < kReach; x += kCell)
      for (double y = -kReach; y < kReach; y += kCell) {
        const Vec3d p = scene_.table->point + u * x + v * y;
        if (!(reference::table_irradiance(scene_, p).lamps[0][0] > 0)) shadow.push_back(p);
      }
    const reference::SurfacePicture surfaces = reference::see_surfaces(scene_, camera_);
    const double radiance = kAlbedo[0] / std::numbers::pi * on_table(1)[0];
    for (int y = 0; y < surfaces.height; ++y)
      for (int x = 0; x < surfaces.width; ++x) {
        const std::size_t pixel = surfaces.index(x, y);
        if (surfaces.surfaces[pixel].kind != reference::SurfaceKind::face) continue;
        const Pose face = compose(scene_.probe_body, scene_.body.faces[surfaces.surfaces[pixel].index].body_face);
        const Vec3d n = rotate(face.rotation, Vec3d{0, 0, 1}), ray = *camera_.ray(x, y, 0.5, 0.5);
        const Vec3d at = ray * (dot(face.translation, n) / dot(ray, n));
        const double light =
            kLamp[0] * std::max(0.0, dot(n, lamp_)) + kAlbedo[0] * on_table(1)[0] * (1 - dot(n, up)) / 2;
        double lacks = 0;
        for (const Vec3d& p : shadow) {
          const Vec3d to = p - at;
          const double cosines = std::max(0.0, dot(to, n)) * std::max(0.0, -dot(to, up));
          lacks += radiance * kCell * kCell * cosines / std::pow(dot(to, to), 2);
        }
        // All channels of the lamp's light have the same proportions.
        if (light > 0)
          for (std::size_t c = 0; c < 3; ++c) of_lamp_[3 * pixel + c] *= static_cast<float>(1 - lacks / light);
      }
  }

  reference::MarkerStage stage_{.distance_m = 0.45, .elevation_rad = 0.5, .turn_rad = 0.15};
  reference::MarkerCamera camera_;
  Vec3d lamp_;
  reference::MarkerScene scene_;
  std::vector<float> of_sky_, of_lamp_;
};

std::vector<Rgb> irradiances(const Descriptor& light, const std::vector<Vec3d>& normals) {
  std::vector<Rgb> out;
  for (const Vec3d& n : normals) {
    const Irradiance e = irradiance_at(light, vec_cast<float>(n));
    out.push_back({e.r, e.g, e.b});
  }
  return out;
}

double relative_rms(const std::vector<Rgb>& a, const std::vector<Rgb>& truth) {
  double off = 0, all = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    for (std::size_t c = 0; c < 3; ++c) off += std::pow(a[i][c] - truth[i][c], 2), all += truth[i][c] * truth[i][c];
  return std::sqrt(off / all);
}

double error_of(const TableScene& scene, const Descriptor& light, double power, double within_deg) {
  const std::vector<Vec3d> normals = scene.normals(within_deg);
  std::vector<Rgb> truth;
  for (const Vec3d& n : normals) truth.push_back(scene.truth(n, power));
  return relative_rms(irradiances(light, normals), truth);
}

TEST(TableLight, IsPartOfASureDescriptor) {
  for (const double azimuth : {40.0, 120.0, 170.0}) {
    const TableScene scene(azimuth, 35);
    const Descriptor light = scene.estimate(1);
    EXPECT_FALSE(light.flags.has(Flag::unsure)) << azimuth;
    // The ambient light makes up for the error of the lamp's irradiance where faces are seen. That of a lamp which
    // hardly illuminates them follows from its shadow by the plane's albedo, whose prior has a sigma of 12 %.
    EXPECT_LT(error_of(scene, light, 1, 60), 0.02) << azimuth;
    EXPECT_LT(error_of(scene, light, 1, 180), azimuth < 90 ? 0.04 : 0.12) << azimuth;
  }
}

TEST(TableLight, IsPartOfAnUnsureDescriptor) {
  const TableScene scene(40, 35);
  const Descriptor light = scene.estimate(0);
  EXPECT_TRUE(light.flags.has(Flag::unsure)) << "there is no lamp";
  EXPECT_LT(error_of(scene, light, 0, 60), 0.03);
}

// The lamp fades out until it is no longer certain.
TEST(TableLight, DoesNotJumpWhereTheFlagToggles) {
  for (const double azimuth : {40.0, 170.0}) {
    const TableScene scene(azimuth, 35);
    double sure = 1, unsure = 0;
    // Ends with two pictures that differ by 1/256 of the lamp's light.
    for (int k = 0; k < 8; ++k) {
      const double middle = (sure + unsure) / 2;
      (scene.estimate(middle).flags.has(Flag::unsure) ? unsure : sure) = middle;
    }
    const Descriptor before = scene.estimate(sure), after = scene.estimate(unsure);
    ASSERT_FALSE(before.flags.has(Flag::unsure)) << azimuth;
    ASSERT_TRUE(after.flags.has(Flag::unsure)) << azimuth;
    // What is left is the difference of a point light and a maximum-entropy radiance, and the body's shadow on the
    // table, which lacks in the light of the faces where the surroundings are taken for distant.
    const std::vector<Vec3d> normals = scene.normals(60);
    EXPECT_LT(relative_rms(irradiances(after, normals), irradiances(before, normals)), 0.1)
        << azimuth << " deg, at a power of " << sure;
  }
}

}  // namespace
}  // namespace lightwell::marker::test
