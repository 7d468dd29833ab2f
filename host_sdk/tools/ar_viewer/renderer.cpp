#include "ar_viewer/renderer.hpp"

#include <array>
#include <utility>

#include <lightwell/glm.hpp>

#include "ar_viewer/stopwatch.hpp"

namespace lightwell::viewer {
namespace {

/// Nearest and farthest distance that is drawn, m.
constexpr float kNearPlane = 0.01F, kFarPlane = 100;

/// Camera frame to clip space.
glm::mat4 clip_of(const CameraModel& camera) {
  const double w = camera.width, h = camera.height;
  glm::mat4 m(0);
  m[0][0] = static_cast<float>(2 * camera.fx / w);
  m[1][1] = static_cast<float>(2 * camera.fy / h);
  // The centre of pixel 0 is half a pixel from the edge.
  m[2][0] = static_cast<float>(1 - 2 * (camera.cx + 0.5) / w);
  m[2][1] = static_cast<float>(2 * (camera.cy + 0.5) / h - 1);
  m[2][2] = -(kFarPlane + kNearPlane) / (kFarPlane - kNearPlane);
  m[2][3] = -1;
  m[3][2] = -2 * kFarPlane * kNearPlane / (kFarPlane - kNearPlane);
  return m;
}

}  // namespace

Renderer::Renderer(const Scene& scene, Programs programs, ObjectSet objects, ShadowMaps shadow_maps,
                   std::array<LightMaps, 2> light_maps)
    : scene_(&scene),
      programs_(std::move(programs)),
      objects_(std::move(objects)),
      shadow_maps_(std::move(shadow_maps)),
      light_maps_(std::move(light_maps)),
      object_reflections_(scene.reflection.objects_edge),
      target_(scene.camera.width, scene.camera.height),
      split_sum_(make_split_sum_table()) {
  constexpr std::array<float, 8> kCorners = {-1, -1, -1, 1, 1, -1, 1, 1};
  glBindVertexArray(ground_.name());
  glBindBuffer(GL_ARRAY_BUFFER, ground_corners_.name());
  glBufferData(GL_ARRAY_BUFFER, sizeof kCorners, kCorners.data(), GL_STATIC_DRAW);
  glEnableVertexAttribArray(0);
  glVertexAttribPointer(0, 2, GL_FLOAT, GL_FALSE, 0, nullptr);
}

Result<Renderer> Renderer::make(const Scene& scene) {
  Result<ObjectPrograms> object_programs = ObjectPrograms::make();
  if (!object_programs.ok()) return object_programs.status();
  Result<ShaderProgram> ground = ShaderProgram::make("ground_vertex.glsl", "ground_fragment.glsl");
  if (!ground.ok()) return ground.status();
  Result<ShaderProgram> background = ShaderProgram::make("screen_vertex.glsl", "background_fragment.glsl");
  if (!background.ok()) return background.status();
  Result<ObjectSet> objects = ObjectSet::make(scene.objects);
  if (!objects.ok()) return objects.status();
  Result<ShadowMaps> shadow_maps = ShadowMaps::make();
  if (!shadow_maps.ok()) return shadow_maps.status();
  Result<ResidualShadow> left = ResidualShadow::make(), right = ResidualShadow::make();
  if (!left.ok()) return left.status();
  if (!right.ok()) return right.status();
  Result<ReflectionMaps> left_maps = ReflectionMaps::make(scene.reflection);
  if (!left_maps.ok()) return left_maps.status();
  Result<ReflectionMaps> right_maps = ReflectionMaps::make(scene.reflection);
  if (!right_maps.ok()) return right_maps.status();
  return Renderer(
      scene, {std::move(*object_programs), std::move(*ground), std::move(*background)}, std::move(*objects),
      std::move(*shadow_maps),
      {LightMaps{std::move(*left), std::move(*left_maps)}, LightMaps{std::move(*right), std::move(*right_maps)}});
}

void Renderer::set_background(const Picture& picture) {
  glBindTexture(GL_TEXTURE_2D, background_.name());
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA32F, picture.width, picture.height, 0, GL_RGBA, GL_FLOAT, picture.rgba.data());
  set_sampling(GL_TEXTURE_2D, GL_NEAREST, GL_NEAREST, GL_CLAMP_TO_EDGE);
}

void Renderer::set_reflection(const ReflectionStyle& style) {
  for (LightMaps& maps : light_maps_) maps.reflection_maps.set_style(style);
  object_reflections_ = ObjectReflections(style.objects_edge);
}

Viewpoint Renderer::viewpoint(const Pose& T_world_camera) const {
  return {clip_of(scene_->camera) * glm::mat4(to_glm(inverse(T_world_camera))),
          glm::vec3(to_glm(T_world_camera.translation))};
}

void Renderer::draw_background() {
  target_.bind();
  glDisable(GL_DEPTH_TEST);
  glDisable(GL_BLEND);
  glActiveTexture(GL_TEXTURE0 + static_cast<GLenum>(Unit::background));
  glBindTexture(GL_TEXTURE_2D, background_.name());
  programs_.background.use();
  glBindVertexArray(screen_.name());
  glDrawArrays(GL_TRIANGLES, 0, 3);
}

Result<DrawTimes> Renderer::prepare(const LightState& light, LightMaps& maps) {
  DrawTimes times;
  objects_.place(light.T_world_origin);
  // Constant light has no shadow; objects do not shade each other either.
  const CasterBounds casters = light.shading == Shading::constant ? CasterBounds{} : objects_.bounds();
  casters_.clear();
  for (std::size_t i = 0; i < objects_.size(); ++i) casters_.push_back(objects_.bounds(i));
  shadow_maps_.update(light, scene_->exposure, casters_, casters,
                      [this](const ShaderProgram& program) { objects_.draw_depth(program); });
  const Stopwatch light_time;
  maps.reflection_maps.query(light, scene_->exposure);
  times.light_ms = light_time.ms();
  maps.reflection_maps.draw(light);
  glActiveTexture(GL_TEXTURE0 + static_cast<GLenum>(Unit::split_sum));
  glBindTexture(GL_TEXTURE_2D, split_sum_.name());
  if (scene_->ground && light.shading != Shading::constant) {
    const Stopwatch shadow_time;
    const auto square = maps.residual_shadow.update(light, *scene_->ground, objects_.positions(), objects_.indices());
    if (!square.ok()) return square.status();
    residual_square_ = *square;
    times.shadow_ms = shadow_time.ms();
  }
  return times;
}

void Renderer::draw_ground(const Viewpoint& from) {
  const Ground& ground = *scene_->ground;
  const ShaderProgram& program = programs_.ground;
  program.use();
  program.set("clip_world", from.clip_world);
  program.set("world_plane", glm::mat4(to_glm(ground.T_world_plane)));
  program.set("half_size", glm::vec2(ground.width_m / 2, ground.depth_m / 2));
  program.set("residual_centre", glm::vec2(residual_square_.centre_x, residual_square_.centre_z));
  program.set("residual_half", static_cast<float>(residual_square_.half_m));
  program.set("strength", scene_->shadow.strength);
  program.set("gain", scene_->shadow.gain);
  program.set("alpha_cutoff", scene_->shadow.alpha_cutoff);
  program.set("alpha_test", scene_->shadow.display == ShadowDisplay::alpha_test ? 1 : 0);
  glBindVertexArray(ground_.name());
  glDrawArrays(GL_TRIANGLE_STRIP, 0, 4);
}

Result<DrawTimes> Renderer::draw(const LightState& light, const Pose& T_world_camera, Columns columns, Half half) {
  LightMaps& maps = light_maps_[static_cast<std::size_t>(half)];
  DrawTimes times;
  if (light.shading != Shading::off) {
    const Result<DrawTimes> prepared = prepare(light, maps);
    if (!prepared.ok()) return prepared.status();
    times = *prepared;
    object_reflections_.update(objects_, programs_.objects, maps.reflection_maps.last_level());
  }
  glEnable(GL_SCISSOR_TEST);
  glScissor(columns.first, 0, columns.count, target_.height());
  draw_background();
  if (light.shading != Shading::off) {
    glEnable(GL_DEPTH_TEST);
    glClear(GL_DEPTH_BUFFER_BIT);
    const Viewpoint from = viewpoint(T_world_camera);
    if (scene_->ground && light.shading != Shading::constant) {
      glEnable(GL_BLEND);
      glBlendFuncSeparate(GL_ZERO, GL_SRC_COLOR, GL_ZERO, GL_ONE);
      draw_ground(from);
      glDisable(GL_BLEND);
    }
    for (std::size_t i = 0; i < objects_.size(); ++i)
      objects_.draw(i, programs_.objects, from, maps.reflection_maps.last_level(), object_reflections_.bind(i));
  }
  glDisable(GL_SCISSOR_TEST);
  return times;
}

Status Renderer::draw_shadow(const LightState& light, const Pose& T_world_camera) {
  const bool casts = light.shading != Shading::off && light.shading != Shading::constant && scene_->ground;
  if (casts) {
    const Result<DrawTimes> prepared = prepare(light, light_maps_[0]);
    if (!prepared.ok()) return prepared.status();
  }
  target_.bind();
  glDisable(GL_BLEND);
  glEnable(GL_DEPTH_TEST);
  glClearColor(1, 1, 1, 1);
  glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
  if (casts) draw_ground(viewpoint(T_world_camera));
  return {};
}

}  // namespace lightwell::viewer
