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
  const lw::Plane moved = std::move(*plane);
  CHECK(moved.info().validity == LW_VALID);
  CHECK(plane->diffuse({0, 0}).validity == LW_INVALID_QUERY);
  return checks_failed(12);
}
