// What a light field makes of flat emitters: panels below the ceiling, windows, lit patches of a wall.
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include <lightwell/field.hpp>

#include "host_sdk/field/field_scenes.hpp"

namespace lightwell::test {
namespace {

TEST(FieldEmittersTest, APanelThatAllProbesSeeAtOneAngleMayShineDownMore) {
  // The four places are at nearly one angle from it: a ball explains what they see as well as a panel does.
  const Disc panel{{0, 2.6, 0}, {0, -1, 0}, 0.15};
  const std::vector<Vec3d> ring{{1.5, 1.2, 0}, {0, 1.2, 1.5}, {-1.5, 1.2, 0}, {0, 1.2, -1.5}};
  const LightField field = field_of(panel, ring);
  const Vec3d below{0, 1.2, 0};
  const double error = irradiance_error(field, panel, below);
  EXPECT_LT(error, static_cast<double>(field.at(below, {}).light.descriptor().bound.total) * 1.5);
  // The bound is relative to the RMS over normals of all light, of which the panel is nearly all.
  EXPECT_GT(field.at(below, {}).light.descriptor().bound.total, field.at(ring[0], {}).light.descriptor().bound.total);
}

TEST(FieldEmittersTest, CloseToAFlatEmitterTheDirectionIsThatOfItsVectorIrradiance) {
  const Disc window{{2, 1.5, 0}, {-1, 0, 0}, 0.4, 5};
  const LightField field =
      field_of(window, {{0, 1.2, 1.5}, {0.5, 1.4, -0.8}, {-1, 1.6, 0.1}, {1.2, 1.1, 1.8}, {0.8, 2.2, 0.4}});
  for (const Vec3d point : {Vec3d{1.3, 1.0, 0.3}, {1.4, 1.9, -0.4}, {1.5, 1.2, 0.5}}) {
    const auto primary = field.at(point, {}).light.primary_light();
    ASSERT_TRUE(primary);
    const Vec3d truth = vec_cast<double>(window.seen_from(point).direction);
    const double middle = angle_between(window.center - point, truth);
    // The middle of the window is off by its foreshortening; five points follow it to a third of that.
    EXPECT_LT(angle_between(vec_cast<double>(primary->direction), truth), 0.4 * middle + 0.005);
    EXPECT_GT(middle, 0.03);
    EXPECT_LT(irradiance_error(field, window, point), 0.1);
  }
}

}  // namespace
}  // namespace lightwell::test
