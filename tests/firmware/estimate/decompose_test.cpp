#include <gtest/gtest.h>

#include <cmath>
#include <lightwell/query.hpp>
#include <numbers>

#include "estimate/common/decompose.hpp"
#include "reference/irradiance.hpp"
#include "reference/panorama.hpp"

namespace lightwell::estimate {
namespace {

namespace ref = reference;

/// A panorama's projection by plain sums over its pixels.
Projection projected(const ref::Panorama& p) {
  Projection out;
  for (int j = 0; j < p.height; ++j) {
    for (int i = 0; i < p.width; ++i) {
      const ref::V3 d = ref::pixel_direction(i, j, p.width, p.height);
      const BasisRow y = basis_row({d.x, d.y, d.z});
      const ref::Rgb l = ref::pixel(p, i, j);
      const double sr = ref::pixel_solid_angle(j, p.width, p.height);
      for (std::size_t k = 0; k < kRowCount; ++k)
        for (std::size_t c = 0; c < 3; ++c) out.c[k][c] += sr * l[c] * y[k];
    }
  }
  return out;
}

double true_error(const ref::Panorama& p, const RadianceSh& rest, std::span<const Light> lights) {
  const auto normals = ref::fibonacci_normals(2048);
  const auto truth = ref::irradiance_at(p, normals);
  Descriptor d;
  d.radiance = rest;
  d.lights.assign(lights.begin(), lights.end());
  std::vector<ref::Rgb> got;
  for (const ref::V3& n : normals) {
    const Irradiance e = irradiance_at(d, {static_cast<float>(n.x), static_cast<float>(n.y), static_cast<float>(n.z)});
    got.push_back({e.r, e.g, e.b});
  }
  const ref::IrradianceError e = ref::irradiance_error(truth, got);
  return std::max(e.rms, e.luminance_weighted);
}

ref::Panorama sky_and_lamp() {
  const ref::Panorama sky = ref::from_function(256, 128, [](const ref::V3& d) {
    return ref::Rgb{d.y > 0 ? 2.0 : 0.3, d.y > 0 ? 2.5 : 0.3, d.y > 0 ? 4.0 : 0.2};
  }, 4);
  return ref::sum(sky, ref::disc_lamp(256, 128, ref::normalised({1, 2, 0.5}), 0.05, {300, 280, 200}));
}

TEST(Decompose, StatesTheErrorOfStoppingAtEachBand) {
  const ref::Panorama p = sky_and_lamp();
  const Projection scene = projected(p);
  for (const int band : {0, 1, 2, 3, 4, 5, 6}) {
    const Decomposition parts = decompose(scene, {}, band);
    const double stated = relative(parts.truncation, parts.whole), truth = true_error(p, parts.rest, {});
    // Parseval is exact for the bands looked at; above 12 a point's spectrum is taken, a few percent of the rest.
    EXPECT_NEAR(stated / truth, 1, 0.05) << "band " << band << " stated " << stated << " true " << truth;
  }
}

TEST(Decompose, CountsWhatACapMissesOfItsLamp) {
  const ref::Panorama p = sky_and_lamp();
  const Projection scene = projected(p);
  Light right;
  right.direction = normalized(Vec3f{1, 2, 0.5F});
  right.angular_radius_rad = 0.05F;
  const auto e = static_cast<float>(std::numbers::pi * std::sin(0.05) * std::sin(0.05));
  right.irradiance = {300 * e, 280 * e, 200 * e};
  Light off = right;
  off.direction = normalized(Vec3f{1.15F, 2, 0.5F});
  Light wide = right;
  wide.angular_radius_rad = 0.6F;
  double before = 0;
  for (const Light& light : {right, off, wide}) {
    const Decomposition parts = decompose(scene, std::span(&light, 1), 4);
    const double stated = relative(parts.truncation, parts.whole), truth = true_error(p, parts.rest, std::span(&light, 1));
    // The true error of the right cap is what floats leave, 1e-5.
    EXPECT_GT(stated + 1e-4, 0.9 * truth);
    EXPECT_LT(stated, 1.5 * truth + 1e-3);
    if (before > 0) EXPECT_GT(stated, before) << "a worse cap is a larger error";
    else before = stated;
  }
}

TEST(Decompose, OfASceneThatIsItsLightsLeavesNothing) {
  Light light;
  light.direction = normalized(Vec3f{0.2F, -0.3F, 0.9F});
  light.irradiance = {5, 4, 3};
  light.angular_radius_rad = 0.1F;
  Projection scene;
  const BasisRow y = basis_row(vec_cast<double>(light.direction));
  std::size_t at = 0;
  const auto put = [&](int l) {
    for (int m = -l; m <= l; ++m, ++at)
      for (int c = 0; c < 3; ++c) scene.c[at][static_cast<std::size_t>(c)] = light.irradiance[c] * cap_zonal(l, 0.1F) * y[at];
  };
  for (int l = 0; l <= kMaxBand; ++l) put(l);
  for (const int l : kTailBands) put(l);
  const Decomposition parts = decompose(scene, std::span(&light, 1), 4);
  EXPECT_LT(relative(parts.truncation, parts.whole), 1e-6);
  for (std::size_t i = 0; i < 25; ++i) EXPECT_NEAR(parts.rest.c[i].r, 0, 1e-5);
}

TEST(Decompose, OfDarknessIsNoError) {
  const Decomposition parts = decompose({}, {}, 4);
  EXPECT_EQ(parts.whole.plain, 0);
  EXPECT_EQ(relative(parts.truncation, parts.whole), 0);
}

}  // namespace
}  // namespace lightwell::estimate
