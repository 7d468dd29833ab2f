// The functions that a render loop calls do not allocate.
#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include <lightwell/cube_map.h>
#include <lightwell/lightwell.h>
#include <lightwell/shadows.h>

#include "support/allocation_counter.hpp"

namespace lightwell::test {
namespace {

TEST(CAbiAllocation, ARenderLoopAllocatesNothing) {
  const std::string uri = "replay:" LIGHTWELL_ANSWERS "/answers.lwrec?speed=0";
  lw_probe* probe = nullptr;
  ASSERT_EQ(lw_probe_connect(uri.data(), uri.size(), nullptr, &probe), LW_OK) << lw_last_error(nullptr);
  lw_lighting *light = nullptr, *other = nullptr;
  ASSERT_EQ(lw_lighting_create(&light), LW_OK);
  ASSERT_EQ(lw_lighting_create(&other), LW_OK);
  lw_lighting_info info{};
  info.size = sizeof info;
  // Play to the end, because the reader thread allocates while it receives.
  std::uint64_t seen = 0;
  while (lw_probe_wait_for_next(probe, &seen, 60'000'000'000, light) == LW_OK) {
    ASSERT_EQ(lw_lighting_get_info(light, &info), LW_OK);
    seen = info.sequence;
  }
  const float normals[6] = {0, 1, 0, 1, 0, 0};
  float values[6];
  lw_answer answer{};
  answer.size = sizeof answer;
  lw_light lights[LW_MAX_LIGHTS];
  float coefficients[3 * LW_MAX_COEFFICIENTS];
  lw_environment map{};
  map.size = sizeof map;
  lw_cube_map_options cube{};
  cube.size = sizeof cube;
  cube.edge = 8;
  std::uint16_t cube_texels[6 * 8 * 8 * 4];
  std::size_t count = 0;
  int failed = 0;
  // A pyramid that crosses the plane, of which one triangle is not finite.
  float corners[5][3] = {{-0.1F, -0.1F, -0.02F}, {0.1F, -0.1F, 0.05F}, {0, 0.1F, 0.05F}, {0, 0, 0.2F}, {0, 0, NAN}};
  const std::uint32_t indices[] = {0, 1, 2, 0, 1, 3, 1, 2, 3, 2, 0, 3, 0, 1, 4};
  lw_shadow_mesh mesh{};
  mesh.size = sizeof mesh;
  mesh.positions = corners;
  mesh.position_count = 5;
  mesh.indices = indices;
  mesh.index_count = 15;
  lw_shadow_receiver plane{};
  plane.size = sizeof plane;
  plane.columns = plane.rows = 32;
  plane.width = plane.height = 0.3;
  float ratios[3 * 32 * 32];
  lw_shadow_summary shadows{};
  shadows.size = sizeof shadows;
  lw_shadow_caster* caster = nullptr;
  ASSERT_EQ(lw_shadow_caster_create(nullptr, &caster), LW_OK);
  const auto frame = [&] {
    failed += lw_probe_latest(probe, light) != LW_OK;
    failed += lw_lighting_copy(light, other) != LW_OK;
    failed += lw_lighting_get_info(light, &info) != LW_OK;
    failed += lw_lighting_irradiance(light, normals, &answer) != LW_OK;
    failed += lw_lighting_irradiance_batch(light, normals, 0, 2, values, 0, &answer) != LW_OK;
    failed += lw_lighting_radiance_batch(light, normals, 0, 2, 0.3F, values, 0, &answer) != LW_OK;
    failed += lw_lighting_harmonics(light, LW_IRRADIANCE, 2, coefficients, nullptr) != LW_OK;
    failed += lw_lighting_lights(light, lights, sizeof *lights, LW_MAX_LIGHTS, &count) != LW_OK;
    failed += lw_lighting_environment(light, &map) != LW_OK;
    failed += lw_lighting_cube_map(light, &cube, cube_texels, sizeof cube_texels, nullptr) != LW_OK;
    // The object moves, so that its silhouettes change.
    for (auto& corner : corners) corner[0] += 0.001F;
    failed += lw_shadow_caster_cast(caster, light, &plane, &mesh, ratios, 3 * 32 * 32, &shadows) != LW_OK;
  };
  frame();  // The thread's cached lobe and error message are created at first use.
  std::size_t allocations = 0;
  {
    const AllocationCount counter;
    for (int i = 0; i < 100; ++i) frame();
    allocations = counter.value();
    if (allocations > 0) AllocationCount::print_first();
  }
  EXPECT_EQ(allocations, 0U);
  EXPECT_EQ(failed, 0);
  EXPECT_EQ(info.sequence, 113U);
  EXPECT_EQ(count, 13U);
  EXPECT_EQ(shadows.ignored_triangles, 1U);
  EXPECT_GT(shadows.lights, 0);

  // The counter covers the library: a rotation allocates.
  const double q[4] = {0, 0, 0, 1};
  {
    const AllocationCount counter;
    EXPECT_EQ(lw_lighting_rotated(light, q, other), LW_OK);
    allocations = counter.value();
  }
  EXPECT_GT(allocations, 0U);
  lw_shadow_caster_release(caster);
  lw_lighting_release(light);
  lw_lighting_release(other);
  lw_probe_close(probe);
}

}  // namespace
}  // namespace lightwell::test
