#include "measure/panorama_truth.hpp"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "reference/ggx.hpp"

namespace lightwell::measure {
namespace {

namespace ref = reference;

/// A sun of 2 degrees on the seam and a coloured, non-uniform background: includes the critical places, poles and seam.
ref::Panorama scene(int width) {
  const ref::RadianceFunction room = [](const ref::V3& d) {
    return ref::Rgb{1 + 0.9 * std::sin(9 * d.x) * d.y, 1 + 0.8 * d.y, 1 + 0.9 * std::cos(7 * d.z + d.x)};
  };
  ref::Panorama p = ref::from_function(width, width / 2, room, 1);
  for (const ref::V3 d : {ref::V3{0.05, 0.3, 1}, {0.02, 1, 0}, {-0.7, -0.1, -1}})
    p = ref::sum(p, ref::disc_lamp(width, width / 2, ref::normalised(d), 0.035, {3000, 2500, 1500}, 8));
  return p;
}

TEST(PanoramaSums, IrradianceEqualsTheReferenceUpToRounding) {
  for (const int width : {2, 6, 64, 256}) {
    const ref::Panorama p = scene(width);
    const PanoramaSums sums(p);
    for (const ref::V3& n : ref::fibonacci_normals(40)) {
      const ref::Rgb want = ref::irradiance(p, n), got = sums.irradiance(n);
      // Rounding errors of up to 32,768 terms summed in different orders.
      for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(got[c], want[c], 1e-11 * (1 + want[c])) << width;
    }
  }
}

TEST(PanoramaSums, RadianceMatchesTheReference) {
  const ref::Panorama p = scene(256);
  const PanoramaSums sums(p);
  for (const double roughness : {0.25, 0.3271, 0.5, 1.0}) {
    double error = 0, power = 0, relative = 0;
    for (const ref::V3& d : ref::fibonacci_normals(60)) {
      const ref::Rgb want = ref::radiance_ggx(p, d, roughness), got = sums.radiance(d, roughness);
      for (std::size_t c = 0; c < 3; ++c) {
        error += (got[c] - want[c]) * (got[c] - want[c]);
        power += want[c] * want[c];
        relative = std::max(relative, std::abs(got[c] - want[c]) / want[c]);
      }
    }
    // Blocks have a radius of at most 0.12 of the kernel's scale; the neglected term is of the order of 0.12^3.
    EXPECT_LT(std::sqrt(error / power), 2e-3) << roughness;
    EXPECT_LT(relative, 1e-2) << roughness;
  }
}

TEST(PanoramaSums, RoughnessZeroIsABilinearSample) {
  const PanoramaSums sums(scene(64));
  const ref::V3 d = ref::normalised({0.3, 0.2, 1});
  EXPECT_EQ(sums.radiance(d, 0), ref::sample(sums.panorama(), d));
}

TEST(PanoramaSums, AConstantPanoramaIsReproduced) {
  const PanoramaSums sums(ref::constant(128, 64, {1, 2, 3}));
  for (const ref::V3& d : ref::fibonacci_normals(20)) {
    const ref::Rgb got = sums.radiance(d, 0.25);
    for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(got[c], static_cast<double>(c) + 1, 1e-12);
  }
}

TEST(PanoramaTruth, CleansAndFindsTheBrightest) {
  ref::Panorama p = ref::sum(ref::constant(64, 32, {1, 1, 1}), ref::disc_lamp(64, 32, {1, 0, 0}, 0.2, {50, 50, 50}, 8));
  ref::set_pixel(p, 3, 3, {-3361, 1, std::numeric_limits<double>::quiet_NaN()});
  const PanoramaTruth truth = panorama_truth("room", p);
  EXPECT_EQ(ref::pixel(truth.sums.panorama(), 3, 3), (ref::Rgb{0, 1, 0}));
  ASSERT_TRUE(truth.brightest);
  EXPECT_LT(ref::angle_deg(truth.brightest->direction, {1, 0, 0}), 0.1);
  EXPECT_EQ(truth.irradiance.size(), 2048U);
}

TEST(PanoramaTruth, ErrorOfIrradianceIsThatOfTheReference) {
  const PanoramaTruth truth = panorama_truth("room", scene(64));
  const auto exact = ref::irradiance_at(truth.sums.panorama(), truth_normals());
  EXPECT_LT(ref::irradiance_error(exact, truth.irradiance).largest, 1e-11);
  const ref::IrradianceError e = irradiance_error(truth, [&](const ref::V3& n) {
    const ref::Rgb right = truth.sums.irradiance(n);
    return ref::Rgb{1.03 * right[0], 1.03 * right[1], 1.03 * right[2]};
  });
  EXPECT_NEAR(e.rms, 0.03, 1e-12);
}

TEST(PanoramaTruth, InvalidFilesAreErrors) {
  EXPECT_EQ(load_panorama_truth("/nowhere/x.exr").status().code(), StatusCode::not_found);
}

}  // namespace
}  // namespace lightwell::measure
