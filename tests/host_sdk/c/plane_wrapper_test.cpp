// The C++17 wrapper of captured planes, built without exceptions and RTTI.
#include <cstdio>
#include <type_traits>
#include <vector>

#include <lightwell/lightwell_c.hpp>

#include "check.h"

static_assert(!std::is_copy_constructible_v<lw::Plane> && std::is_nothrow_move_constructible_v<lw::Plane>);
static_assert(!std::is_copy_constructible_v<lw::PlaneReader> && std::is_nothrow_move_constructible_v<lw::PlaneReader>);

int main(int argc, char** argv) {
  std::FILE* file = argc == 2 ? std::fopen(argv[1], "rb") : nullptr;
  if (file == nullptr) return 2;
  std::vector<unsigned char> message(65536);
  message.resize(std::fread(message.data(), 1, message.size(), file));
  std::fclose(file);

  lw::Result<lw::PlaneReader> reader = lw::PlaneReader::create();
  lw::Result<lw::Plane> plane = lw::Plane::create();
  CHECK(reader.ok() && plane.ok());
  CHECK(reader->take(message.data(), 3, 0).code == LW_DATA_LOSS);
  CHECK(reader->take(message.data(), message.size(), 0).ok());
  CHECK(reader->snapshot(0, *plane).ok());
  CHECK(plane->info().validity == LW_VALID && plane->info().texture_edge == 12);
  const lw_plane_answer all = plane->radiance({0.01, 0.02}, {0.01, 0.02, 0.4});
  const lw_plane_answer diffuse = plane->diffuse({0.01, 0.02}), specular = plane->specular({0, 0, 1});
  CHECK(all.validity == LW_VALID && diffuse.value[0] > 0 && specular.value[0] > 0);
  CHECK(all.value[0] > diffuse.value[0] + specular.value[0] - 1e-6F);
  CHECK(plane->radiance({0.01, 0.02}, {0, 0, -1}).validity == LW_INVALID_QUERY);
  std::vector<float> rgb(3 * 20 * 20);
  auto camera = lw::sized<lw_plane_camera>();
  camera.width = camera.height = 20;
  camera.fx = camera.fy = 50;
  camera.cx = camera.cy = 9.5;
  camera.position[2] = 0.5;
  camera.orientation[3] = 1;
  CHECK(plane->render(camera, LW_PLANE_ALL, rgb.data(), rgb.size()).pixels > 300);
  CHECK(plane->guidance().progress == LW_CAPTURE_ENOUGH);
  lw::Result<lw::PlaneReflector> reflector = lw::PlaneReflector::create();
  lw::Result<lw::PlaneLight> light = lw::PlaneLight::create();
  CHECK(reflector.ok() && light.ok() && light->update(*plane).ok());
  CHECK(light->irradiance({0, 0, 0.05}, {0, 0, -1}).source == LW_PLANE_LIGHT_TEXTURE);
  auto grid = lw::sized<lw_plane_grid>();
  grid.columns = grid.rows = 8;
  grid.width = grid.height = 0.1;
  const float triangle[] = {-0.05F, 0, 0.02F, 0.05F, 0, 0.02F, 0, 0.05F, 0.02F}, radiance[] = {1, 1, 1};
  const std::uint32_t corners[] = {0, 1, 2};
  auto mesh = lw::sized<lw_shadow_mesh>();
  mesh.positions = triangle;
  mesh.position_count = 3;
  mesh.indices = corners;
  mesh.index_count = 3;
  auto object = lw::sized<lw_radiant_mesh>();
  object.radiance_per = LW_RADIANCE_PER_TRIANGLE;
  object.mesh = &mesh;
  object.radiance = radiance;
  object.radiance_count = 1;
  std::vector<float> reflected(3 * 8 * 8), hidden(8 * 8);
  const auto about = reflector->render(*plane, grid, object, {0, -0.2, 0.2}, reflected.data(), reflected.size(),
                                       hidden.data(), hidden.size());
  CHECK(about.ok() && about->validity == LW_VALID && about->texels > 10);
  CHECK(reflector->render(*plane, grid, object, {0, -0.2, 0.2}, reflected.data(), 3, hidden.data(), 64).status().code ==
        LW_INVALID_ARGUMENT);
  const lw::Plane moved = std::move(*plane);
  CHECK(moved.info().validity == LW_VALID);
  CHECK(plane->diffuse({0, 0}).validity == LW_INVALID_QUERY);
  return checks_failed(16);
}
