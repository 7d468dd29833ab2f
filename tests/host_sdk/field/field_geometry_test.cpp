// What proxy geometry adds to a light field: shadows of placed lights, parallax of the rest.
#include <cmath>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <lightwell/field.hpp>

#include "host_sdk/field/field_scenes.hpp"

namespace lightwell::test {
namespace {

using testing::HasSubstr;

const Lamp kLamp{{0, 2.4, 0}};

/// A square table of `half` metres to each side at a height of 1 m.
struct Table {
  std::vector<Vec3f> vertices;
  std::vector<std::uint32_t> indices{0, 1, 2, 0, 2, 3};

  explicit Table(float half) : vertices{{-half, 1, -half}, {half, 1, -half}, {half, 1, half}, {-half, 1, half}} {}
  [[nodiscard]] FieldGeometry geometry() const { return {vertices, indices}; }
};

TEST(LightFieldGeometryTest, ATableThrowsAShadow) {
  const FieldScene scene{.lamps = {kLamp}, .ambient = 0.1F};
  std::vector<Vec3d> places = four_places();
  for (Vec3d& place : places) place.y += 0.5;  // Above the table.
  LightField field = field_of(scene, places);
  const Vec3d below{0, 0.3, 0}, beside{1.9, 0.3, 0};
  const float free = field.irradiance(below, {0, 1, 0}, {}).value.g;
  const float lit = field.irradiance(beside, {0, 1, 0}, {}).value.g;
  ASSERT_TRUE(field.set_geometry(Table(0.5F).geometry()).ok());
  (void)field.update({});
  const float ambient = FieldScene{.ambient = 0.1F}.irradiance(below, {0, 1, 0}).g;
  EXPECT_NEAR(field.irradiance(below, {0, 1, 0}, {}).value.g, ambient, 0.05F * free);
  EXPECT_TRUE(field.at(below, {}).light.lights().empty());
  EXPECT_NEAR(field.irradiance(beside, {0, 1, 0}, {}).value.g, lit, 0.05F * lit);
  ASSERT_TRUE(field.set_geometry({}).ok());
  (void)field.update({});
  EXPECT_NEAR(field.irradiance(below, {0, 1, 0}, {}).value.g, free, 1e-4F);
}

TEST(LightFieldGeometryTest, GeometryThatHidesALampFromTheProbesThatSeeItDoesNotHideIt) {
  // A scan with a wall that is not there: three of four probes would not see the lamp.
  const FieldScene scene{.lamps = {kLamp}};
  LightField field = field_of(scene, four_places());
  const Vec3d point{0.5, 0.4, 0.3};
  const float free = field.irradiance(point, {0, 1, 0}, {}).value.g;
  const std::vector<Vec3f> wall{{-9, 2, -9}, {9, 2, -9}, {9, 2, 9}, {-9, 2, 9}};
  const std::vector<std::uint32_t> indices{0, 1, 2, 0, 2, 3};
  ASSERT_TRUE(field.set_geometry({wall, indices}).ok());
  (void)field.update({});
  EXPECT_NEAR(field.irradiance(point, {0, 1, 0}, {}).value.g, free, 0.1F * free);
}

TEST(LightFieldGeometryTest, ABrightWallIsBrighterNearIt) {
  // The wall at x = 2 is bright, the rest of a box of 4 m dark. The probes' harmonics are those of the true view.
  std::vector<Vec3f> vertices;
  for (int k = 0; k < 8; ++k)
    vertices.push_back({(k & 1) != 0 ? 2.0F : -2.0F, (k & 2) != 0 ? 2.0F : -2.0F, (k & 4) != 0 ? 2.0F : -2.0F});
  const std::vector<std::uint32_t> indices{0, 2, 6, 0, 6, 4, 1, 5, 7, 1, 7, 3, 0, 4, 5, 0, 5, 1,
                                           2, 3, 7, 2, 7, 6, 0, 1, 3, 0, 3, 2, 4, 6, 7, 4, 7, 5};
  const auto seen_from = [](Vec3d place) {
    Descriptor d = FieldScene{.ambient = 0}.at(place);
    d.radiance.band = 6;
    constexpr int kCount = 20'000;
    for (int i = 0; i < kCount; ++i) {
      const Vec3d to = fibonacci_direction(i, kCount);
      const double t = (2 - place.x) / to.x;
      const bool bright = to.x > 0 && std::abs(place.y + t * to.y) < 2 && std::abs(place.z + t * to.z) < 2;
      if (!bright) continue;
      std::array<float, sh_count(6)> basis;
      sh_basis(6, vec_cast<float>(to), basis);
      for (std::size_t k = 0; k < basis.size(); ++k) {
        const float c = basis[k] * 4 * std::numbers::pi_v<float> / kCount;
        d.radiance.c[k] += Radiance{c, c, c};
      }
    }
    return d;
  };
  LightField field = std::move(LightField::make().value());
  const std::vector<Vec3d> places{{0, 0, 0.5}, {-0.5, 0.2, -0.6}};
  for (std::size_t k = 0; k < places.size(); ++k)
    ASSERT_TRUE(field.set(name_of(k), sample_at(places[k], seen_from(places[k]))).ok());
  (void)field.update({});
  const auto error = [&](Vec3d p) {
    const float truth = Lighting::of(seen_from(p)).irradiance({1, 0, 0}).value.g;
    return std::abs(field.irradiance(p, {1, 0, 0}, {}).value.g - truth) / truth;
  };
  const Vec3d near{1.2, 0.1, 0}, away{-1.5, 0, 0};
  const float near_before = error(near), away_before = error(away);
  ASSERT_TRUE(field.set_geometry({vertices, indices}).ok());
  (void)field.update({});
  EXPECT_LT(error(near), 0.5F * near_before);
  EXPECT_LT(error(away), 0.5F * away_before);
  // At a probe it is that probe's light.
  EXPECT_LT(error(places[0]), 0.01F);
}

TEST(LightFieldGeometryTest, ALightInAWallShinesAlongTheWallsNormal) {
  // Two probes: without the wall they do not tell where the window faces.
  const Disc window{{2, 1.5, 0}, {-1, 0, 0}, 0.4, 5};
  const std::vector<Vec3d> places{{0, 1.2, 1}, {0.5, 1.4, -0.8}};
  LightField field = field_of(window, places);
  const std::vector<Vec3f> wall{{2, 0, -3}, {2, 0, 3}, {2, 3, 3}, {2, 3, -3}};
  const std::vector<std::uint32_t> indices{0, 1, 2, 0, 2, 3};
  ASSERT_TRUE(field.set_geometry({wall, indices}).ok());
  (void)field.update({});
  const auto state = field.state();
  ASSERT_EQ(state->lights.size(), 1U);
  const auto& g = state->lights[0].intensity_gradient;
  EXPECT_LT(g[0].g, 0);
  EXPECT_LT(std::hypot(g[1].g, g[2].g), -0.1F * g[0].g);
  // Along the wall it is dark, before it bright.
  EXPECT_LT(irradiance_error(field, window, {1.2, 1.5, 0.2}), 0.15);
  EXPECT_LT(irradiance_error(field, window, {1.7, 1.2, 1.5}), 0.25);
}

TEST(LightFieldGeometryTest, GeometryIsChecked) {
  LightField field = std::move(LightField::make().value());
  Table table(1);
  table.indices[4] = 4;
  EXPECT_THAT(field.set_geometry(table.geometry()).message(), HasSubstr("index 4 of the geometry is beyond its 4"));
  table.indices[4] = 2;
  table.vertices[2].y = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THAT(field.set_geometry(table.geometry()).message(), HasSubstr("not finite"));
  table.indices.pop_back();
  EXPECT_THAT(field.set_geometry(table.geometry()).message(), HasSubstr("three a triangle"));
  const std::vector<std::uint32_t> many(3 * (kMaxFieldTriangles + 1));
  EXPECT_EQ(field.set_geometry({table.vertices, many}).code(), StatusCode::resource_exhausted);
}

}  // namespace
}  // namespace lightwell::test
