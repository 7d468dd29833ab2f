// Programs of the shaders in shaders/.
#pragma once

#include <map>
#include <string>
#include <string_view>

#include <glm/fwd.hpp>

#include <lightwell/result.hpp>

#include "ar_viewer/gl_objects.hpp"

namespace lightwell::viewer {

/// Texture units, the same in every program.
enum class Unit : int {
  background,
  shadow_maps,
  environment,
  irradiance,
  objects,
  residual,
  color,
  normal,
  split_sum,
  map_texels
};

/// The content of a file of shaders/, part of the program; empty if there is none of that name.
[[nodiscard]] std::string_view shader_source(std::string_view file);

/// A linked program. Uniforms that the program does not use are ignored, as OpenGL does.
class ShaderProgram {
 public:
  /// Each stage is version, `defines`, lights.glsl, reflectance.glsl, and its file. internal, with the compiler's log,
  /// if one does not compile.
  [[nodiscard]] static Result<ShaderProgram> make(std::string_view vertex_file, std::string_view fragment_file,
                                                  std::string_view defines = "");

  void use() const { glUseProgram(program_.name()); }
  // The program must be in use.
  void set(const char* uniform, int value) const;
  void set(const char* uniform, float value) const;
  void set(const char* uniform, const glm::ivec2& value) const;
  void set(const char* uniform, const glm::vec2& value) const;
  void set(const char* uniform, const glm::vec3& value) const;
  void set(const char* uniform, const glm::mat3& value) const;
  void set(const char* uniform, const glm::mat4& value) const;

 private:
  ShaderProgram() = default;
  [[nodiscard]] GLint location(const char* uniform) const;

  struct Program {
    static GLuint make() { return glCreateProgram(); }
    static void release(GLuint name) { glDeleteProgram(name); }
  };
  GlObject<Program> program_;
  mutable std::map<std::string, GLint, std::less<>> locations_;
};

}  // namespace lightwell::viewer
