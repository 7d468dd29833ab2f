#include "bench/filament_sh.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "bench/scenes.hpp"
#include "reference/harmonics.hpp"

namespace lightwell::bench {
namespace {

namespace ref = lightwell::reference;
using scenes::Scene;

void expect_near_oracle(const ref::Panorama& panorama, double tolerance) {
  const Scene scene(panorama);
  FilamentRoute route;
  route.load(scene.image());
  const FilamentSh got = route.run();
  const auto oracle = ref::project(scene.panorama, 2);
  for (std::size_t c = 0; c < 3; ++c) {
    for (std::size_t k = 0; k < 9; ++k)
      EXPECT_NEAR(got.radiance[k][c], oracle[k][c], tolerance * oracle[0][c])
          << "coefficient " << k << " channel " << c;
  }
  EXPECT_GT(got.cube_s, 0);
  EXPECT_GT(got.sh_s, 0);
}

// Filament truncates a position that it scales by W - 1 instead of W: a shift of up to one pixel, 2 pi / 1024 = 0.6 %
// of the linear part, which is less than half of the mean here.
TEST(Filament, CoefficientsMatchTheReferenceInOrderAndSign) { expect_near_oracle(scenes::smooth(1024), 0.005); }

// The lamp has 2.5 times the light of the room; it has the same shift, and there are only nine samples per texel.
TEST(Filament, CoefficientsOfALampMatchTheReference) {
  expect_near_oracle(scenes::lamp_in_room(1024, {1, 2, -3}), 0.02);
}

TEST(Filament, DoesNothingWithoutAnImage) {
  FilamentRoute route;
  EXPECT_EQ(route.run().cube_s, 0);
}

}  // namespace
}  // namespace lightwell::bench
