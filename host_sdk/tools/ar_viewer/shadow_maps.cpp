#include "ar_viewer/shadow_maps.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <utility>

#include <lightwell/glm.hpp>

namespace lightwell::viewer {
namespace {

constexpr std::size_t kTaps = 64;
/// Tangent of the largest half angle of a near light's map: a light between the objects does not see all of them.
constexpr float kMaxTangent = 4;

/// ViewerLight of lights.glsl, in std140.
struct LightEntry {
  glm::vec4 towards_radius{0}, irradiance_distance{0}, position{0};
  glm::mat4 view{1};
  glm::vec4 map{0};
};
struct LightBlock {
  std::array<LightEntry, kMaxShadedLights> lights;
  std::array<glm::vec4, kTaps> disc;
  std::array<glm::vec4, Scene::kMaxObjects> casters;
  std::int32_t count = 0, caster_count = 0;
  std::array<float, 2> first_level{};
};
static_assert(sizeof(LightEntry) == 8 * 16 && offsetof(LightBlock, disc) == kMaxShadedLights * 8 * 16);

/// Points of equal areas of the unit disc (Vogel 1979).
std::array<glm::vec4, kTaps> disc_taps() {
  std::array<glm::vec4, kTaps> taps{};
  const float golden_angle = std::numbers::pi_v<float> * (3 - std::sqrt(5.0F));
  for (std::size_t i = 0; i < kTaps; ++i) {
    const float radius = std::sqrt((static_cast<float>(i) + 0.5F) / kTaps),
                angle = golden_angle * static_cast<float>(i);
    taps[i] = {radius * std::cos(angle), radius * std::sin(angle), 0, 0};
  }
  return taps;
}

/// World to axes around `origin` whose +Z is along `travel`.
glm::mat4 view_along(Vec3f travel, Vec3d origin) {
  const auto [u, v] = tangent_basis(travel);
  glm::mat4 m(1);
  for (int column = 0; column < 3; ++column) {
    const auto at = [column](Vec3f a) { return column == 0 ? a.x : column == 1 ? a.y : a.z; };
    m[column] = glm::vec4(at(u), at(v), at(travel), 0);
  }
  m[3] = m * glm::vec4(-glm::vec3(to_glm(origin)), 0);
  m[3].w = 1;
  return m;
}

LightEntry entry_of(const ShadedLight& light, float exposure, const CasterBounds& casters) {
  LightEntry e;
  e.towards_radius = glm::vec4(to_glm(light.direction), light.angular_radius_rad);
  e.irradiance_distance = glm::vec4(to_glm(light.irradiance) * exposure, light.position ? light.distance_m : 0);
  e.position.w = light.shown_in_mirror ? 1 : 0;
  const auto radius = static_cast<float>(casters.radius_m);
  if (!light.position) {
    e.view = view_along(-light.direction, casters.centre);
    e.map = {radius, -radius, radius, radius > 0 ? 1 : 0};
    return e;
  }
  e.position = glm::vec4(glm::vec3(to_glm(*light.position)), e.position.w);
  const Vec3d travel = casters.centre - *light.position;
  const auto distance = static_cast<float>(length(travel));
  const Vec3f axis = distance > 0 ? vec_cast<float>(normalized(travel)) : -light.direction;
  e.view = view_along(axis, *light.position);
  const float inside = distance * distance - radius * radius;
  const float tangent = inside > 0 ? std::min(radius / std::sqrt(inside), kMaxTangent) : kMaxTangent;
  const float largest = distance + radius;
  e.map = {tangent, std::max(distance - radius, 1e-3F * largest), largest, radius > 0 ? 1 : 0};
  return e;
}

}  // namespace

ShadowMaps::ShadowMaps(ShaderProgram program) : program_(std::move(program)) {
  glBindTexture(GL_TEXTURE_2D_ARRAY, maps_.name());
  glTexImage3D(GL_TEXTURE_2D_ARRAY, 0, GL_DEPTH_COMPONENT32F, kEdge, kEdge, static_cast<GLsizei>(kMaxShadedLights), 0,
               GL_DEPTH_COMPONENT, GL_FLOAT, nullptr);
  set_sampling(GL_TEXTURE_2D_ARRAY, GL_NEAREST, GL_NEAREST, GL_CLAMP_TO_BORDER);
  constexpr std::array<float, 4> kEmpty{1, 1, 1, 1};
  glTexParameterfv(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_BORDER_COLOR, kEmpty.data());
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_.name());
  glDrawBuffer(GL_NONE);
  glReadBuffer(GL_NONE);
  glBindBuffer(GL_UNIFORM_BUFFER, block_.name());
  glBufferData(GL_UNIFORM_BUFFER, sizeof(LightBlock), nullptr, GL_DYNAMIC_DRAW);
}

Result<ShadowMaps> ShadowMaps::make() {
  Result<ShaderProgram> program = ShaderProgram::make("depth_vertex.glsl", "depth_fragment.glsl");
  if (!program.ok()) return program.status();
  return ShadowMaps(std::move(*program));
}

void ShadowMaps::update(const LightState& light, float exposure, std::span<const CasterBounds> casters,
                        const CasterBounds& all, const std::function<void(const ShaderProgram&)>& draw) const {
  const std::vector<ShadedLight>& lights = light.lights;
  LightBlock block;
  block.first_level = light.first_level;
  block.disc = disc_taps();
  block.count = static_cast<std::int32_t>(std::min(lights.size(), kMaxShadedLights));
  for (std::size_t i = 0; i < static_cast<std::size_t>(block.count); ++i)
    block.lights[i] = entry_of(lights[i], exposure, all);
  block.caster_count = static_cast<std::int32_t>(std::min(casters.size(), Scene::kMaxObjects));
  for (std::size_t i = 0; i < static_cast<std::size_t>(block.caster_count); ++i)
    block.casters[i] = glm::vec4(glm::vec3(to_glm(casters[i].centre)), static_cast<float>(casters[i].radius_m));
  glBindBuffer(GL_UNIFORM_BUFFER, block_.name());
  glBufferSubData(GL_UNIFORM_BUFFER, 0, sizeof block, &block);
  glBindBufferBase(GL_UNIFORM_BUFFER, 0, block_.name());

  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_.name());
  glViewport(0, 0, kEdge, kEdge);
  glEnable(GL_DEPTH_TEST);
  program_.use();
  for (std::int32_t i = 0; i < block.count && all.radius_m > 0; ++i) {
    glFramebufferTextureLayer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, maps_.name(), 0, i);
    glClear(GL_DEPTH_BUFFER_BIT);
    program_.set("index", i);
    draw(program_);
  }
  glActiveTexture(GL_TEXTURE0 + static_cast<GLenum>(Unit::shadow_maps));
  glBindTexture(GL_TEXTURE_2D_ARRAY, maps_.name());
}

}  // namespace lightwell::viewer
