// The grid of Unity's light probes that lightwell-field writes, read by the formulas of Unity's documents.
#include "field_grid.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <lightwell/field.hpp>

#include "host_sdk/field/field_scenes.hpp"
#include "host_sdk/field/unity_grid_file.hpp"
#include "support/temp_dir.hpp"

namespace lightwell::test {
namespace {

using reference::Rgb;
using reference::V3;
using ::testing::Each;
using ::testing::HasSubstr;
using tool::GridLights;
using tool::PointGrid;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN(), kInfinite = std::numeric_limits<double>::infinity();

const FieldScene kRoom{.lamps = {{{0.4, 2.2, -0.3}}, {{-1.1, 1.9, 0.9}, {1, 2, 4}}}, .sun = {2, 2, 1.5F}};

std::vector<V3> random_normals() {
  std::mt19937 random(23);
  std::normal_distribution<double> normal;
  std::vector<V3> out;
  for (int i = 0; i < 512; ++i) out.push_back(reference::normalised({normal(random), normal(random), normal(random)}));
  return out;
}

class FieldGridTest : public ::testing::Test {
 protected:
  [[nodiscard]] UnityGridFile write(const LightField& field, const PointGrid& grid,
                                    GridLights lights = GridLights::in_harmonics, HostTime now = {}) const {
    const Status status = tool::write_field_grid(field, now, grid, lights, path_);
    EXPECT_TRUE(status.ok()) << status.message();
    return UnityGridFile(path_);
  }

  TempDir folder_;
  const std::string path_ = folder_.path("grid.json");
};

/// RMS over normals and channels of what `from_file` gives minus what the field answers, relative to the latter.
template <class FromFile>
double error_at(const LightField& field, const V3& unity, FromFile&& from_file) {
  const Lighting here = field.at({unity.x, unity.y, -unity.z}, {}).light;
  double difference = 0, whole = 0;
  for (const V3& n : random_normals()) {
    const Irradiance ours = here.irradiance(vec_cast<float>(Vec3d{n.x, n.y, -n.z})).value;
    const Rgb file = from_file(n);
    for (std::size_t c = 0; c < 3; ++c) {
      const auto t = static_cast<double>(ours[static_cast<int>(c)]);
      difference += (file[c] - t) * (file[c] - t);
      whole += t * t;
    }
  }
  return std::sqrt(difference / whole);
}

TEST_F(FieldGridTest, ThePointsAreThoseOfTheBoxInUnitysAxes) {
  const auto grid = PointGrid::with_spacing({-1, 0.5, -2}, {1, 1.5, -0.2}, 0.6);
  ASSERT_TRUE(grid.ok());
  EXPECT_EQ(grid->counts, (std::array<std::uint32_t, 3>{5, 3, 4}));  // Steps of 0.5, 0.5 and 0.6 m.
  const UnityGridFile file = write(field_of(kRoom, four_places()), *grid);
  EXPECT_EQ(file.document.at("format"), "lightwell.unity_grid");
  EXPECT_EQ(file.document.at("version"), 1);
  EXPECT_EQ(file.document.at("units"), "absolute");
  const auto counts = file.document.at("counts").get<std::vector<std::size_t>>();
  const auto origin = file.document.at("origin").get<std::vector<double>>();
  const auto spacing = file.document.at("spacing").get<std::vector<double>>();
  ASSERT_EQ(file.size(), counts[0] * counts[1] * counts[2]);
  for (std::size_t i = 0; i < file.size(); ++i) {
    // x fastest, then y, then z: what a loader computes from the head.
    const std::array<std::size_t, 3> cell{i % counts[0], i / counts[0] % counts[1], i / counts[0] / counts[1]};
    for (std::size_t axis = 0; axis < 3; ++axis)
      EXPECT_NEAR(file.positions.at(3 * i + axis), origin[axis] + spacing[axis] * static_cast<double>(cell[axis]),
                  1e-9);
  }
  EXPECT_NEAR(file.position(0).z, 0.2, 1e-12);  // Ours: -0.2.
  EXPECT_NEAR(file.position(file.size() - 1).z, 2, 1e-12);
  EXPECT_NEAR(file.position(file.size() - 1).x, 1, 1e-12);
  EXPECT_THAT(file.document.at("lights"), ::testing::SizeIs(0));
}

TEST_F(FieldGridTest, TheHarmonicsGiveTheFieldsIrradianceWithinTheStatedResidual) {
  const LightField field = field_of(kRoom, four_places());
  const UnityGridFile file = write(field, PointGrid::with_spacing({-1.4, 0.3, -1.2}, {1.3, 1.6, 1.1}, 0.9).value());
  EXPECT_THAT(file.validity, Each(1));
  for (std::size_t i = 0; i < file.size(); ++i) {
    const double error = error_at(field, file.position(i), [&](const V3& n) { return file.irradiance(i, n); });
    // 512 other normals than those of the residual: a tenth of it. The lamps are most of the light: it is not small.
    EXPECT_NEAR(error, file.residual[i], 0.1 * file.residual[i] + 1e-4);
    EXPECT_GT(file.residual[i], 0.01);
    EXPECT_GT(file.bound[i], 0);
  }
}

TEST_F(FieldGridTest, LightsApartAndHarmonicsAddUpToTheFieldsIrradiance) {
  const LightField field = field_of(kRoom, four_places());
  const UnityGridFile file =
      write(field, PointGrid::with_spacing({-1.4, 0.3, -1.2}, {1.3, 1.2, 1.1}, 0.9).value(), GridLights::apart);
  ASSERT_THAT(file.document.at("lights"), ::testing::SizeIs(3));
  for (std::size_t i = 0; i < file.size(); ++i) {
    const V3 point = file.position(i);
    const double error = error_at(field, point, [&](const V3& n) {
      const Rgb direct = file.irradiance_of_lights(point, n), rest = file.irradiance(i, n);
      return Rgb{direct[0] + rest[0], direct[1] + rest[1], direct[2] + rest[2]};
    });
    // Lamps of 5 cm at a metre are points but where the horizon clips them, and intensities are even within a percent.
    EXPECT_LT(error, 0.02);
    EXPECT_LT(file.residual[i], 1e-3);  // What is left is even ambient light.
  }
}

TEST_F(FieldGridTest, AFlatEmitterIsNoPointLightAndStaysInTheHarmonics) {
  const LightField field =
      field_of(Disc{{0, 2.4, 0}, {0, -1, 0}}, {{-1.5, 1.2, -1.4}, {1.6, 1.0, -1.2}, {0.4, 1.4, 1.5}, {-0.3, 0.6, 0.6}});
  ASSERT_EQ(field.state()->lights.size(), 1U);
  EXPECT_FALSE(tool::is_even(field.state()->lights[0]));
  const PointGrid grid = PointGrid::with_spacing({-1, 0.5, -1}, {1, 1, 1}, 1).value();
  const UnityGridFile apart = write(field, grid, GridLights::apart);
  EXPECT_THAT(apart.document.at("lights"), ::testing::SizeIs(0));
  EXPECT_EQ(apart.harmonics, write(field, grid).harmonics);
}

TEST_F(FieldGridTest, APointInALampIsNotWrittenAsLightAndOneInAProbeIs) {
  const Vec3d lamp = kRoom.lamps[0].position, probe = four_places()[0];
  const LightField field = field_of(kRoom, four_places());
  for (const GridLights lights : {GridLights::in_harmonics, GridLights::apart}) {
    const UnityGridFile at_lamp = write(field, PointGrid::with_spacing(lamp, lamp, 1).value(), lights);
    ASSERT_EQ(at_lamp.size(), 1U);
    EXPECT_EQ(at_lamp.validity[0], 0);
    EXPECT_THAT(at_lamp.harmonics, Each(0));
    EXPECT_EQ(at_lamp.bound[0], -1);
    EXPECT_EQ(at_lamp.residual[0], -1);
    EXPECT_EQ(at_lamp.flags[0], 1U << static_cast<unsigned>(FieldFlag::at_light));
  }
  const UnityGridFile at_probe = write(field, PointGrid::with_spacing(probe, probe, 1).value());
  EXPECT_EQ(at_probe.validity[0], 1);
  EXPECT_LT(error_at(field, at_probe.position(0), [&](const V3& n) { return at_probe.irradiance(0, n); }),
            1.1 * at_probe.residual[0]);
}

TEST_F(FieldGridTest, OldLightAndOneWithoutABoundSaySo) {
  const LightField field = field_of(kRoom, {{0, 1, 0}});
  const PointGrid grid = PointGrid::with_spacing({0, 1, 0}, {6, 1, 0}, 6).value();
  const UnityGridFile now = write(field, grid);
  EXPECT_THAT(now.validity, Each(1));
  EXPECT_GT(now.bound[0], 0);
  EXPECT_EQ(now.bound[1], -1);
  EXPECT_EQ(now.flags[0], 1U << static_cast<unsigned>(FieldFlag::one_probe));
  EXPECT_EQ(now.flags[1] & ~now.flags[0], 1U << static_cast<unsigned>(FieldFlag::far_from_probes));
  const UnityGridFile later = write(field, grid, GridLights::in_harmonics, HostTime{} + Duration{10'000'000'000});
  EXPECT_THAT(later.validity, Each(1));
  EXPECT_EQ(later.flags[0], now.flags[0] | 1U << kFieldFlags.size());
}

TEST_F(FieldGridTest, WithoutProbesNothingIsWritten) {
  const LightField empty = std::move(LightField::make().value());
  const PointGrid grid = PointGrid::with_spacing({}, {1, 1, 1}, 1).value();
  const Status status = tool::write_field_grid(empty, {}, grid, GridLights::in_harmonics, path_);
  EXPECT_EQ(status.code(), StatusCode::failed_precondition);
  EXPECT_THAT(status.message(), HasSubstr("no probe"));
  EXPECT_FALSE(std::filesystem::exists(path_));
  const Status nowhere = tool::write_field_grid(field_of(kRoom, four_places()), {}, grid, GridLights::in_harmonics,
                                                folder_.path("absent/grid.json"));
  EXPECT_EQ(nowhere.code(), StatusCode::unavailable);
}

TEST(PointGridTest, RefusesBoxesThatAreNone) {
  const auto refusal = [](Vec3d from, Vec3d to, double spacing) {
    return PointGrid::with_spacing(from, to, spacing).status();
  };
  for (const double bad : {0.0, -1.0, kNan, kInfinite})
    EXPECT_EQ(refusal({}, {1, 1, 1}, bad).code(), StatusCode::invalid_argument);
  for (const double bad : {kNan, kInfinite, -kInfinite, 1e300}) {
    EXPECT_EQ(refusal({bad, 0, 0}, {1, 1, 1}, 1).code(), StatusCode::invalid_argument);
    EXPECT_EQ(refusal({}, {1, 1, bad}, 1).code(), StatusCode::invalid_argument);
  }
  EXPECT_THAT(refusal({0, 2, 0}, {1, 1, 1}, 1).message(), HasSubstr("along y"));
  // A million points, and more than any integer holds.
  for (const double spacing : {1 / 99.5, 1e-6, 1e-300}) {
    const Status status = refusal({}, {1, 1, 1}, spacing);
    EXPECT_EQ(status.code(), StatusCode::resource_exhausted) << spacing;
    EXPECT_THAT(status.message(), HasSubstr("100000 points"));
  }
}

TEST(PointGridTest, RoundingAddsNoPoint) {
  // 1.1 / 0.1 is above 11 in double.
  EXPECT_EQ(PointGrid::with_spacing({}, {1.1, 0, 0}, 0.1)->counts, (std::array<std::uint32_t, 3>{12, 1, 1}));
  EXPECT_EQ(PointGrid::with_spacing({}, {1.11, 0, 0}, 0.1)->counts, (std::array<std::uint32_t, 3>{13, 1, 1}));
  EXPECT_EQ(PointGrid::with_spacing({}, {9.99, 9.99, 9.99}, 0.222)->size(), 97336U);
}

}  // namespace
}  // namespace lightwell::test
