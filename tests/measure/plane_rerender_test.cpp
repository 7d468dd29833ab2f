// The SDK's re-rendering of a plane, after the wire, against the re-rendering of the figures (plane_views), which
// shares no code with it.
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include <lightwell/plane_appearance.hpp>
#include <lightwell/plane_codec.hpp>

#include "measure/plane_views.hpp"
#include "support/captured_planes.hpp"

namespace lightwell::measure {
namespace {

constexpr int kEdge = 128, kLevels = 40;

/// A linear texture, because the figures average four rays a pixel and the SDK has one; random specular radiance.
CapturedPlane captured() {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> uniform(0, 0.2F);
  CapturedPlane out = test::linear_plane(kEdge, kLevels, 10);
  for (Radiance& v : out.texture.radiance) v = v * 0.6F;
  for (Radiance& v : out.lumisphere.radiance) v = {uniform(random), uniform(random), uniform(random)};
  out.info.texture_to_plane = {0.002, -0.003, 0.004, 1.005};
  return out;
}

PlaneAppearance of_figures(const CapturedPlane& plane) {
  PlaneAppearance out;
  out.texels = {plane.info.size_m, plane.texture.edge};
  for (const Radiance& v : plane.texture.radiance) out.texture.push_back({v.r, v.g, v.b, 0});
  // (1 + scale) (x + rotation x + translation), first order.
  const PlaneSimilarity& s = plane.info.texture_to_plane;
  out.alignment = {s.x_m / s.scale, s.y_m / s.scale, s.rotation_rad, s.scale - 1};
  out.specular = specular::Lumisphere(plane.lumisphere.grid.levels());
  out.specular.value = plane.lumisphere.radiance;
  std::ranges::fill(out.specular.weight, 1.0F);
  return out;
}

lightwell::PlaneAppearance after_the_wire(const CapturedPlane& plane) {
  PlaneEncoder encoder({.images = ImageRecipients::all_clients});
  PlaneReader reader;
  const auto messages = encoder.encode(plane, plane.info.mid_exposure);
  EXPECT_TRUE(messages.ok());
  for (const auto& bytes : *messages) EXPECT_TRUE(reader.take(bytes, {}).ok());
  return reader.snapshot({});
}

TEST(PlaneRerender, SdkAndFiguresAgree) {
  SpecularSequenceOptions options;
  options.environment = "gradient";
  options.alpha = 0.4;
  options.frames = 1;
  options.width = 200, options.height = 150, options.focal_px = 175;
  const auto sequence = SpecularSequence::make(options);
  ASSERT_TRUE(sequence.ok()) << sequence.status().message();
  const CapturedPlane plane = captured();
  const lightwell::PlaneAppearance sdk = after_the_wire(plane);
  const reference::PinholeCamera pinhole = (*sequence)->pinhole();

  std::vector<HeldOutView> views;
  std::size_t written = 0;
  for (int k = 0; k < (*sequence)->held_out_count(); k += 4) {
    HeldOutView view;
    view.probe_plane = (*sequence)->held_out_pose(k);
    const PlaneCamera camera{pinhole.width, pinhole.height, pinhole.focal_px,         pinhole.focal_px,
                             pinhole.cx,    pinhole.cy,     inverse(view.probe_plane)};
    const auto pixels = static_cast<std::size_t>(pinhole.width) * static_cast<std::size_t>(pinhole.height);
    std::vector<float> rgb(3 * pixels, -1.0F);
    const PlaneRendering done = sdk.render(camera, PlaneLayers::all, rgb);
    ASSERT_EQ(done.validity, Validity::valid);
    written += done.pixels;
    for (std::size_t i = 0; i < pixels; ++i) {
      // Texels are constant beyond the outermost centres: a pixel there has another mean than its middle.
      const Vec3d eye = camera.T_plane_camera.translation;
      const Vec3d ray =
          rotate(camera.T_plane_camera.rotation, Vec3d{(static_cast<double>(i % 200) - camera.cx) / camera.fx,
                                                       (camera.cy - static_cast<double>(i / 200)) / camera.fy, -1});
      const Vec3d p = eye - ray * (eye.z / ray.z);
      const bool inside = std::abs(p.x) < 0.09 && std::abs(p.y) < 0.09;
      view.truth.coverage.push_back(inside && rgb[3 * i] >= 0 ? 1 : 0);
      EXPECT_TRUE(!inside || rgb[3 * i] >= 0);
    }
    view.truth.rgb.assign(rgb.begin(), rgb.end());
    views.push_back(std::move(view));
  }
  EXPECT_GT(written, 10'000U);
  PlaneAppearance figures = of_figures(plane);
  // Nine bits of texture and specular part, each below 0.6; the roundings of single pixels are independent.
  const double rmse = view_errors(**sequence, views, figures).rmse;
  EXPECT_LT(rmse, 0.0005) << rmse;
  // The comparison notices an error of the alignment by 4 mm, and nodes that are one off.
  figures.alignment.x_m += 0.004;
  EXPECT_GT(view_errors(**sequence, views, figures).rmse, 0.002);
  figures.alignment.x_m -= 0.004;
  for (std::size_t n = 1; n < figures.specular.value.size(); ++n)
    figures.specular.value[n - 1] = figures.specular.value[n];
  EXPECT_GT(view_errors(**sequence, views, figures).rmse, 0.01);
}

}  // namespace
}  // namespace lightwell::measure
