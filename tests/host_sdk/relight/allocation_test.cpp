// Relighting of a performance, frame by frame.
#include <cstdio>
#include <string>

#include <gtest/gtest.h>

#include <lightwell/relight_stream.hpp>

#include "host_sdk/relight/wall_scene.hpp"
#include "support/allocation_counter.hpp"

namespace lightwell::test {
namespace {

TEST(BasisReader, AllocatesNothingForAFrame) {
  WallScene scene;
  scene.basis = {{{0.3, 0, 0}, LightDistance::finite, {3, 2, 1}}, {{-1, 0.5, 0}, LightDistance::finite, {1, 2, 3}}};
  const std::string path = ::testing::TempDir() + "relight_allocation_test";
  auto writer = BasisWriter::create(path, scene.camera.columns, scene.camera.rows, 2);
  ASSERT_TRUE(writer.ok());
  ASSERT_TRUE(writer->add(spans_of(scene.photographs())).ok() && writer->add(spans_of(scene.photographs())).ok());
  ASSERT_TRUE(writer->close().ok());
  const std::vector<RgbFactor> white(4, RgbFactor{1, 1, 1});
  AlphaMaps alpha;
  ASSERT_TRUE(alpha
                  .compute(scene.subject(), scene.basis, std::array{pattern_at({0.3, 0, 0}, 2, 2, white)},
                           std::array{RgbFactor{1, 1, 1}, RgbFactor{1, 0, 1}})
                  .ok());
  auto reader = BasisReader::open(path);
  ASSERT_TRUE(reader.ok());
  std::vector<Radiance> out(scene.camera.pixels());
  const AllocationCount count;
  const bool done = reader->relight(alpha, 1, out).ok() && reader->relight(alpha, 0, out).ok();
  EXPECT_EQ(count.value(), 0U);
  EXPECT_TRUE(done);
  std::remove(path.c_str());
}

}  // namespace
}  // namespace lightwell::test
