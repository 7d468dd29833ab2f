// Tests of Panorama: mapping of directions, continuity at seam and poles, and sanitising of invalid values.
#include "sim/panorama.hpp"

#include <cmath>
#include <limits>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <lightwell/equirect.hpp>

namespace lightwell::sim {
namespace {

using testing::HasSubstr;

constexpr double kPi = std::numbers::pi;

/// A soft lamp about +X, its luminance a smooth function of direction.
Radiance lamp_at_plus_x(Vec3d d) {
  const auto l = static_cast<float>(std::exp(6 * (d.x - 1)));
  return {l, 0.5F * l, 0.25F * l};
}

TEST(Panorama, ALampAtPlusXIsSeenThere) {
  const Panorama p = from_function(256, lamp_at_plus_x);
  EXPECT_NEAR(p.radiance({1, 0, 0}).r, 1, 2e-3)
      << "error of interpolation: second derivative 6, half a pixel of 1/40 rad";
  EXPECT_NEAR(p.radiance({1, 0, 0}).b, 0.25, 5e-4);
  EXPECT_LT(p.radiance({-1, 0, 0}).r, 1e-4F);
  EXPECT_GT(p.radiance({1, 0.2, 0}).r, p.radiance({1, 0.4, 0}).r);
}

TEST(Panorama, PixelCentresShowThePixel) {
  const Panorama p = from_function(32, [](Vec3d d) {
    return Radiance{static_cast<float>(d.x + 1), static_cast<float>(d.y + 1), static_cast<float>(d.z + 1)};
  });
  for (int j = 0; j < 16; ++j) {
    for (int i = 0; i < 32; ++i) {
      const Radiance l = p.radiance(equirect_direction((i + 0.5) / 32, (j + 0.5) / 16));
      EXPECT_NEAR(l.r, p.pixel(i, j).r, 1e-6);
      EXPECT_NEAR(l.g, p.pixel(i, j).g, 1e-6);
      EXPECT_NEAR(l.b, p.pixel(i, j).b, 1e-6);
    }
  }
}

TEST(Panorama, SeamAndPolesAreContinuous) {
  const Panorama p = from_function(64, [](Vec3d d) {
    return Radiance{static_cast<float>(2 + d.x), static_cast<float>(2 + d.z), 1};
  });
  // Compare a point with its neighbours on all sides: the radiance changes by at most 1/rad, plus the error of bilinear
  // interpolation with pixels of 0.1 rad near a pole.
  constexpr double kStep = 1e-4;
  for (const Vec3d at : {Vec3d{0, 0, 1}, Vec3d{0, 1, 0}, Vec3d{0, -1, 0}, Vec3d{0, 0.9, 0.4}}) {
    const auto [u, v] = tangent_basis(normalized(at));
    for (int k = 0; k < 32; ++k) {
      const double a = 2 * kPi * k / 32;
      const Vec3d side = (u * std::cos(a) + v * std::sin(a)) * kStep;
      const Radiance here = p.radiance(at + side), there = p.radiance(at - side);
      EXPECT_NEAR(here.r, there.r, 4 * kStep);
      EXPECT_NEAR(here.g, there.g, 4 * kStep);
    }
  }
}

TEST(Panorama, ATurnAboutYIsAnAdditionToU) {
  for (const double yaw : {0.3, 2.0, -1.1}) {
    const Vec3d d = normalized(Vec3d{0.3, -0.5, 0.7});
    const SpherePoint turned = sphere_point(rotate(Quat::about({0, 1, 0}, yaw), d));
    const auto shift =
        static_cast<std::uint32_t>(static_cast<std::int64_t>(std::llround(yaw / (2 * kPi) * 4294967296.0)));
    const SpherePoint added{sphere_point(d).u - shift, sphere_point(d).v};
    EXPECT_NEAR(static_cast<double>(static_cast<std::int32_t>(turned.u - added.u)), 0, 4);
    EXPECT_NEAR(static_cast<double>(turned.v), static_cast<double>(added.v), 4);
  }
}

TEST(Panorama, InvalidRadianceIsReplacedAndCounted) {
  constexpr float kInf = std::numeric_limits<float>::infinity();
  std::vector<float> rgb(3 * 4 * 2, 1.0F);
  rgb[0] = std::numeric_limits<float>::quiet_NaN();
  rgb[5] = -3361;
  rgb[7] = -kInf;
  rgb[9] = kInf;
  rgb[10] = 42;
  const Result<Panorama> p = make_panorama(4, 2, rgb);
  ASSERT_TRUE(p.ok());
  EXPECT_EQ(p->sanitize_counts.nan, 1U);
  EXPECT_EQ(p->sanitize_counts.negative, 2U);
  EXPECT_EQ(p->sanitize_counts.infinite, 1U);
  EXPECT_EQ(p->rgb[0], 0);
  EXPECT_EQ(p->rgb[5], 0);
  EXPECT_EQ(p->rgb[7], 0);
  EXPECT_EQ(p->rgb[9], 42) << "the largest finite value of the file";
}

TEST(Panorama, MustBeTwiceAsWideAsHigh) {
  const Result<Panorama> p = make_panorama(4, 3, std::vector<float>(36));
  EXPECT_EQ(p.status().code(), StatusCode::invalid_argument);
  EXPECT_THAT(p.status().message(), HasSubstr("4x3"));
  EXPECT_THAT(p.status().message(), HasSubstr("2:1"));
}

TEST(LuminancePercentile, CountsSolidAngleNotPixels) {
  // The upper half of the sphere is bright.
  const Panorama p = from_function(64, [](Vec3d d) {
    const float l = d.y > 0 ? 10.0F : 1.0F;
    return Radiance{l, l, l};
  });
  EXPECT_NEAR(luminance_percentile(p, 0.49), 1, 1e-6);
  EXPECT_NEAR(luminance_percentile(p, 0.51), 10, 1e-5);
}

/// Sets an environment variable for the duration of a test.
class Environment {
 public:
  Environment(const char* name, const std::string& value) : name_(name) {
    if (const char* before = std::getenv(name)) before_ = before;
    setenv(name, value.c_str(), 1);
  }
  Environment(const Environment&) = delete;
  Environment& operator=(const Environment&) = delete;
  ~Environment() {
    if (before_.empty()) {
      unsetenv(name_);
    } else {
      setenv(name_, before_.c_str(), 1);
    }
  }

 private:
  const char* name_;
  std::string before_;
};

TEST(ScenePath, PathsAreUnchanged) {
  EXPECT_EQ(*scene_path("/tmp/my.exr"), "/tmp/my.exr");
  EXPECT_EQ(*scene_path("room.hdr"), "room.hdr");
}

TEST(ScenePath, UnknownNamesGetASuggestion) {
  const Result<std::string> path = scene_path("citty");
  EXPECT_EQ(path.status().code(), StatusCode::invalid_argument);
  EXPECT_THAT(path.status().message(), HasSubstr("did you mean 'city'"));
  EXPECT_THAT(path.status().message(), HasSubstr("sunrise"));
}

TEST(ScenePath, AMissingFileIsReportedWithTheRemedy) {
  const Environment folder("LIGHTWELL_PANORAMA_DIR", "/nowhere/at/all");
  const Result<std::string> path = scene_path("city");
  EXPECT_EQ(path.status().code(), StatusCode::not_found);
  EXPECT_THAT(path.status().message(), HasSubstr("/nowhere/at/all/city.exr"));
  EXPECT_THAT(path.status().message(), HasSubstr("cmake/fetch_panoramas"));
}

TEST(ScenePath, TheDefaultFolderIsThatOfTheFetcher) {
  const Environment own("LIGHTWELL_PANORAMA_DIR", "");
  const Environment cache("LIGHTWELL_CACHE", "/nowhere/cache");
  EXPECT_THAT(scene_path("night").status().message(), HasSubstr("/nowhere/cache/panoramas/night.exr"));
}

}  // namespace
}  // namespace lightwell::sim
