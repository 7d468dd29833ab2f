// Re-rendering of a captured plane does not allocate.
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <lightwell/plane_appearance.h>
#include <lightwell/plane_objects.h>

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

TEST(CAbiAllocation, ObjectsOnAPlaneAllocateNothing) {
  const std::string message = read_file(LIGHTWELL_PLANE);
  lw_plane_reader* reader = nullptr;
  lw_plane* plane = nullptr;
  lw_plane_reflector* reflector = nullptr;
  lw_plane_light* light = nullptr;
  ASSERT_EQ(lw_plane_reader_create(&reader), LW_OK);
  ASSERT_EQ(lw_plane_create(&plane), LW_OK);
  ASSERT_EQ(lw_plane_reflector_create(nullptr, &reflector), LW_OK);
  ASSERT_EQ(lw_plane_light_create(&light), LW_OK);
  ASSERT_EQ(lw_plane_reader_take(reader, message.data(), message.size(), 0), LW_OK) << lw_last_error(nullptr);
  ASSERT_EQ(lw_plane_reader_snapshot(reader, 0, plane), LW_OK);
  const float positions[] = {-0.05F, 0, -0.02F, 0.05F, 0, 0.06F, 0, 0.05F, 0.02F, 0, 0, 0.1F};
  const std::uint32_t indices[] = {0, 1, 2, 0, 2, 3};
  const std::vector<float> radiance(12, 1.0F);
  lw_shadow_mesh mesh{};
  mesh.size = sizeof mesh;
  mesh.positions = positions, mesh.position_count = 4;
  mesh.indices = indices, mesh.index_count = 6;
  lw_radiant_mesh object{};
  object.size = sizeof object;
  object.mesh = &mesh;
  object.radiance = radiance.data(), object.radiance_count = 4;
  lw_plane_grid grid{};
  grid.size = sizeof grid;
  grid.columns = grid.rows = 32;
  grid.width = grid.height = 0.2;
  lw_plane_reflection about{};
  about.size = sizeof about;
  lw_plane_light_answer answer{};
  answer.size = sizeof answer;
  std::vector<float> reflected(3 * 32 * 32), hidden(32 * 32);
  const double point[3] = {0.01, 0.02, 0.05}, down[3] = {0, 0.1, -1};
  int failed = 0;
  const auto frame = [&](double elevation) {
    const double eye[3] = {0.1, -0.2, elevation};
    failed += lw_plane_reflector_render(reflector, plane, &grid, &object, eye, reflected.data(), reflected.size(),
                                        hidden.data(), hidden.size(), &about) != LW_OK;
    failed += lw_plane_light_update(light, plane) != LW_OK;
    failed += lw_plane_light_irradiance(light, point, down, LW_PLANE_ALL, &answer) != LW_OK;
  };
  // The largest mirror image is that of the lowest eye.
  for (const double elevation : {0.2, 0.1, 0.05}) frame(elevation);
  std::size_t allocations = 0;
  {
    const AllocationCount counter;
    for (int i = 0; i < 20; ++i) frame(0.05 + 0.01 * i);
    allocations = counter.value();
    if (allocations > 0) AllocationCount::print_first();
  }
  EXPECT_EQ(allocations, 0U);
  EXPECT_EQ(failed, 0);
  EXPECT_GT(about.texels, 100U);
  EXPECT_EQ(answer.source, LW_PLANE_LIGHT_TEXTURE);
  lw_plane_reflector_release(reflector);
  lw_plane_light_release(light);
  lw_plane_release(plane);
  lw_plane_reader_release(reader);
}

}  // namespace
}  // namespace lightwell::test
