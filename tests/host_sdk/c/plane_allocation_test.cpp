// Re-rendering of a captured plane does not allocate.
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <lightwell/plane_appearance.h>

#include "support/allocation_counter.hpp"
#include "support/read_file.hpp"

namespace lightwell::test {
namespace {

TEST(CAbiAllocation, ReRenderingAPlaneAllocatesNothing) {
  const std::string message = read_file(LIGHTWELL_PLANE);
  lw_plane_reader* reader = nullptr;
  lw_plane *plane = nullptr, *other = nullptr;
  ASSERT_EQ(lw_plane_reader_create(&reader), LW_OK);
  ASSERT_EQ(lw_plane_create(&plane), LW_OK);
  ASSERT_EQ(lw_plane_create(&other), LW_OK);
  ASSERT_EQ(lw_plane_reader_take(reader, message.data(), message.size(), 0), LW_OK) << lw_last_error(nullptr);
  ASSERT_EQ(lw_plane_reader_snapshot(reader, 0, plane), LW_OK);
  std::vector<float> rgb(3 * 64 * 48);
  std::vector<std::uint8_t> flags(64 * 48);
  lw_plane_camera camera{};
  camera.size = sizeof camera;
  camera.width = 64, camera.height = 48;
  camera.fx = camera.fy = 80;
  camera.cx = 32, camera.cy = 24;
  camera.position[2] = 0.4;
  camera.orientation[3] = 1;
  lw_plane_rendering about{};
  about.size = sizeof about;
  lw_plane_answer answer{};
  answer.size = sizeof answer;
  lw_plane_info info{};
  info.size = sizeof info;
  const double point[2] = {0.01, 0.02}, eye[3] = {0.1, 0.2, 0.3};
  int failed = 0;
  std::size_t allocations = 0;
  {
    const AllocationCount counter;
    for (int i = 0; i < 20; ++i) {
      // Unchanged since the last snapshot: nothing is copied.
      failed += lw_plane_reader_snapshot(reader, i, plane) != LW_OK;
      failed += lw_plane_copy(plane, other) != LW_OK;
      failed += lw_plane_get_info(other, &info) != LW_OK;
      failed += lw_plane_radiance(other, point, eye, LW_PLANE_ALL, &answer) != LW_OK;
      failed += lw_plane_diffuse(other, point, &answer) != LW_OK;
      failed += lw_plane_specular(other, eye, &answer) != LW_OK;
      failed += lw_plane_render(other, &camera, LW_PLANE_ALL, rgb.data(), rgb.size(), flags.data(), flags.size(),
                                &about) != LW_OK;
    }
    allocations = counter.value();
    if (allocations > 0) AllocationCount::print_first();
  }
  EXPECT_EQ(allocations, 0U);
  EXPECT_EQ(failed, 0);
  EXPECT_GT(about.pixels, 1000U);
  EXPECT_EQ(answer.validity, LW_VALID);
  lw_plane_release(plane);
  lw_plane_release(other);
  lw_plane_reader_release(reader);
}

}  // namespace
}  // namespace lightwell::test
