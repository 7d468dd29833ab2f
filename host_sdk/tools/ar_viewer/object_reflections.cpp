#include "ar_viewer/object_reflections.hpp"

#include <algorithm>
#include <array>

#include <glm/gtc/constants.hpp>
#include <glm/gtc/matrix_transform.hpp>

#include <lightwell/glm.hpp>

namespace lightwell::viewer {
namespace {

struct FaceAxes {
  glm::vec3 forward, up;
};
/// Of OpenGL's cube map.
constexpr std::array<FaceAxes, 6> kFaces = {{{{1, 0, 0}, {0, -1, 0}},
                                             {{-1, 0, 0}, {0, -1, 0}},
                                             {{0, 1, 0}, {0, 0, 1}},
                                             {{0, -1, 0}, {0, 0, -1}},
                                             {{0, 0, 1}, {0, -1, 0}},
                                             {{0, 0, -1}, {0, -1, 0}}}};

/// World to clip space of a face.
glm::mat4 clip_of_face(const FaceAxes& face, const glm::vec3& eye, float near, float far) {
  return glm::perspective(glm::radians(90.0F), 1.0F, near, far) * glm::lookAt(eye, eye + face.forward, face.up);
}

/// Whether a sphere reaches into the pyramid of a face. `centre`: from the eye.
bool shows(const FaceAxes& face, const glm::vec3& centre, float radius) {
  const glm::vec3 right = glm::cross(face.forward, face.up);
  for (const glm::vec3& side : {right, -right, face.up, -face.up})
    if (glm::dot(centre, face.forward + side) < -glm::root_two<float>() * radius) return false;
  return true;
}

}  // namespace

void ObjectReflections::update(const ObjectSet& objects, const ObjectPrograms& programs, float environment_levels) {
  maps_.resize(objects.size());
  if (edge_ == 0 || objects.size() < 2) return;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    if (objects.reflects(i))
      draw_map(i, objects, programs, environment_levels);
    else
      maps_[i].reset();
  }
}

void ObjectReflections::draw_map(std::size_t i, const ObjectSet& objects, const ObjectPrograms& programs,
                                 float environment_levels) {
  if (!framebuffer_) {
    framebuffer_.emplace();
    depth_.emplace();
    glBindRenderbuffer(GL_RENDERBUFFER, depth_->name());
    glRenderbufferStorage(GL_RENDERBUFFER, GL_DEPTH_COMPONENT24, edge_, edge_);
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_->name());
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, depth_->name());
  }
  glActiveTexture(GL_TEXTURE0 + static_cast<GLenum>(Unit::objects));
  if (!maps_[i]) {
    maps_[i].emplace();
    glBindTexture(GL_TEXTURE_CUBE_MAP, maps_[i]->cube.name());
    for (GLenum face = 0; face < 6; ++face)
      glTexImage2D(GL_TEXTURE_CUBE_MAP_POSITIVE_X + face, 0, GL_RGBA16F, edge_, edge_, 0, GL_RGBA, GL_FLOAT, nullptr);
    set_sampling(GL_TEXTURE_CUBE_MAP, GL_LINEAR_MIPMAP_LINEAR, GL_LINEAR, GL_CLAMP_TO_EDGE);
  }
  const CasterBounds own = objects.bounds(i);
  const glm::vec3 eye = to_glm(own.centre);
  double far = own.radius_m;
  for (std::size_t k = 0; k < objects.size(); ++k)
    far = std::max(far, length(objects.bounds(k).centre - own.centre) + objects.bounds(k).radius_m);
  glBindTexture(GL_TEXTURE_CUBE_MAP, 0);  // Not read while it is drawn.
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_->name());
  glViewport(0, 0, edge_, edge_);
  glClearColor(0, 0, 0, 0);
  for (GLenum face = 0; face < kFaces.size(); ++face) {
    const FaceAxes& axes = kFaces[face];
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_CUBE_MAP_POSITIVE_X + face,
                           maps_[i]->cube.name(), 0);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    const Viewpoint from{
        clip_of_face(axes, eye, static_cast<float>(0.05 * own.radius_m), static_cast<float>(1.01 * far)), eye};
    for (std::size_t k = 0; k < objects.size(); ++k) {
      const CasterBounds other = objects.bounds(k);
      if (k != i && shows(axes, glm::vec3(to_glm(other.centre - own.centre)), static_cast<float>(other.radius_m)))
        objects.draw(k, programs, from, environment_levels, 0);
    }
  }
  glActiveTexture(GL_TEXTURE0 + static_cast<GLenum>(Unit::objects));
  glBindTexture(GL_TEXTURE_CUBE_MAP, maps_[i]->cube.name());
  glGenerateMipmap(GL_TEXTURE_CUBE_MAP);
}

float ObjectReflections::bind(std::size_t i) const {
  glActiveTexture(GL_TEXTURE0 + static_cast<GLenum>(Unit::objects));
  const bool has_map = i < maps_.size() && maps_[i].has_value();
  glBindTexture(GL_TEXTURE_CUBE_MAP, has_map ? maps_[i]->cube.name() : 0);
  return has_map ? static_cast<float>(edge_) : 0;
}

}  // namespace lightwell::viewer
