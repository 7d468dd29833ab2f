// The C++17 wrapper of the C ABI, built without exceptions and RTTI, as in game engines.
#include <cmath>
#include <cstring>
#include <type_traits>

#include <lightwell/lightwell_c.hpp>

#include "check.h"

static_assert(__cplusplus == 201703L, "this program is about C++17");
static_assert(!std::is_copy_constructible_v<lw::Lighting> && std::is_nothrow_move_constructible_v<lw::Lighting>);
static_assert(!std::is_copy_constructible_v<lw::Probe> && std::is_nothrow_move_constructible_v<lw::Probe>);

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  const std::string uri = std::string("replay:") + argv[1] + "?speed=0";
  const auto nowhere = lw::Probe::connect("replay:/nowhere");
  CHECK(!nowhere.ok() && nowhere.status().code == LW_NOT_FOUND && !nowhere.status().message.empty());

  auto options = lw::sized<lw_probe_options>();
  options.max_age_ns = 3'600'000'000'000;
  lw::Result<lw::Probe> connected = lw::Probe::connect(uri, options);
  CHECK(connected.ok());
  if (!connected.ok()) return checks_failed(1);
  lw::Probe probe = std::move(*connected);
  CHECK(probe.text(LW_PROBE_NAME) == "attic");

  std::optional<std::uint64_t> seen;
  for (auto next = probe.wait_for_next(seen, 60'000'000'000); next; next = probe.wait_for_next(seen, 60'000'000'000))
    seen = next->info().sequence;
  CHECK(seen == 113U && probe.stats().state == LW_LINK_ENDED);

  lw::Result<lw::Lighting> light = lw::Lighting::create();
  CHECK(light.ok() && light->info().validity == LW_NONE && !light->reason().empty());
  CHECK(probe.latest(*light).ok() && light->info().validity == LW_VALID && light->reason().empty());
  const lw::Vec3 normals[2] = {{0, 1, 0}, {1, 0, 0}};
  lw::Vec3 values[2];
  const lw_answer about = light->irradiance(normals, 2, values);
  CHECK(about.validity == LW_VALID && about.units == LW_ABSOLUTE);
  const lw_answer up = light->irradiance(normals[0]);
  CHECK(std::abs(up.value[0] - values[0][0]) <= 1e-5F * up.value[0] && up.value[0] > 0);
  CHECK(light->radiance(normals, 2, 0.35F, values).refused == 0);
  CHECK(std::memcmp(light->radiance(normals[1], 0.35F).value, values[1].data(), 12) == 0);
  CHECK(light->harmonics(LW_RADIANCE).size() == 49U && light->harmonics(LW_RADIANCE)[0][0] > 1000);
  CHECK(light->lights().size() == 13U && light->lights()[0].irradiance[0] >= light->lights()[1].irradiance[0]);
  const auto levels = light->environment_levels();
  CHECK(levels.size() == 3U && levels[0].edge == 16 && levels[0].rgb.size() == 768U && levels[2].roughness == 1);

  // A rotation by pi about +Y maps the light at +X to -X.
  const auto turned = light->rotated({0, 1, 0, 0});
  CHECK(turned.ok());
  const auto placed = light->in_world({1, 2, 3}, {0, 1, 0, 0});
  CHECK(placed.ok() && placed->info().origin_position[1] == light->info().origin_position[1] + 2);
  const float a = turned->irradiance(lw::Vec3{-1, 0, 0}).value[0], b = light->irradiance(lw::Vec3{1, 0, 0}).value[0];
  CHECK(a > b - 1 && a < b + 1);
  CHECK(light->copy().ok() && light->copy()->info().sequence == 113U);
  CHECK(probe.at(0).ok() && probe.at(0)->info().validity == LW_BEFORE_HISTORY);
  CHECK(probe.report_lux(100, {0, 1, 0}).status().code == LW_FAILED_PRECONDITION);
  auto config = lw::sized<lw_estimator_config>();
  CHECK(lw_estimator_config_defaults(&config) == LW_OK);
  CHECK(probe.set_estimator(config).code == LW_FAILED_PRECONDITION);
  CHECK(probe.change_estimator(config, LW_FIELD_EPSILON).code == LW_FAILED_PRECONDITION);
  CHECK(probe.estimator_config().status().code == LW_FAILED_PRECONDITION && !probe.estimator_kind().ok());

  lw::Result<lw::ShadowCaster> caster = lw::ShadowCaster::create();
  CHECK(caster.ok());
  const lw::Vec3 corners[3] = {{-9, -9, 0.1F}, {9, -9, 0.1F}, {0, 9, 0.1F}};
  const std::uint32_t triangle[3] = {0, 1, 2};
  auto mesh = lw::sized<lw_shadow_mesh>();
  mesh.positions = corners;
  mesh.position_count = 3;
  mesh.indices = triangle;
  mesh.index_count = 3;
  auto plane = lw::sized<lw_shadow_receiver>();
  plane.columns = plane.rows = 2;
  plane.width = plane.height = 0.01;
  float ratios[12];
  const auto summary = caster->cast(*light, plane, mesh, ratios, 12);
  CHECK(summary.ok() && summary->no_light == 0 && ratios[0] < 0.2F);
  CHECK(caster->cast(*light, plane, mesh, ratios, 11).status().code == LW_INVALID_ARGUMENT);
  lw::Lighting taken = std::move(*light);
  CHECK(taken.info().sequence == 113U && light->info().validity == LW_INVALID_QUERY);
  CHECK(light->irradiance(lw::Vec3{0, 1, 0}).validity == LW_INVALID_QUERY && light->lights().empty());
  const unsigned char nonsense[3] = {1, 2, 3};
  CHECK(lw::Lighting::decode(nonsense, 3).status().code == LW_DATA_LOSS);
  return checks_failed(20);
}
