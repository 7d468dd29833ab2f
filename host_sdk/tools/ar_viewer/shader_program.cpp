#include "ar_viewer/shader_program.hpp"

#include <array>
#include <vector>

#include <glm/glm.hpp>
#include <glm/gtc/type_ptr.hpp>

namespace lightwell::viewer {
namespace {

Status compile(GLuint shader, std::string_view file, std::string_view defines) {
  const std::array<std::string_view, 5> parts = {"#version 330 core\n", defines, shader_source("lights.glsl"),
                                                 shader_source("reflectance.glsl"), shader_source(file)};
  std::array<const GLchar*, parts.size()> texts{};
  std::array<GLint, parts.size()> lengths{};
  for (std::size_t i = 0; i < parts.size(); ++i) {
    texts[i] = parts[i].data();
    lengths[i] = static_cast<GLint>(parts[i].size());
  }
  glShaderSource(shader, static_cast<GLsizei>(parts.size()), texts.data(), lengths.data());
  glCompileShader(shader);
  GLint compiled = GL_FALSE;
  glGetShaderiv(shader, GL_COMPILE_STATUS, &compiled);
  if (compiled == GL_TRUE) return {};
  std::array<GLchar, 2048> log{};
  glGetShaderInfoLog(shader, static_cast<GLsizei>(log.size()), nullptr, log.data());
  return {StatusCode::internal, std::string(file) + ": the shader does not compile: " + log.data()};
}

}  // namespace

Result<ShaderProgram> ShaderProgram::make(std::string_view vertex_file, std::string_view fragment_file,
                                          std::string_view defines) {
  ShaderProgram result;
  const GLuint program = result.program_.name();
  for (const auto& [kind, file] :
       {std::pair{GL_VERTEX_SHADER, vertex_file}, std::pair{GL_FRAGMENT_SHADER, fragment_file}}) {
    const GLuint shader = glCreateShader(static_cast<GLenum>(kind));
    const Status status = compile(shader, file, defines);
    if (status.ok()) glAttachShader(program, shader);
    glDeleteShader(shader);
    if (!status.ok()) return status;
  }
  glLinkProgram(program);
  GLint linked = GL_FALSE;
  glGetProgramiv(program, GL_LINK_STATUS, &linked);
  if (linked != GL_TRUE) {
    std::array<GLchar, 2048> log{};
    glGetProgramInfoLog(program, static_cast<GLsizei>(log.size()), nullptr, log.data());
    return Status(StatusCode::internal, std::string(fragment_file) + ": the program does not link: " + log.data());
  }
  const GLuint block = glGetUniformBlockIndex(program, "Lights");
  if (block != GL_INVALID_INDEX) glUniformBlockBinding(program, block, 0);
  result.use();
  constexpr std::array kSamplers = {
      std::pair{"background_picture", Unit::background}, std::pair{"shadow_maps", Unit::shadow_maps},
      std::pair{"environment_map", Unit::environment},   std::pair{"irradiance_map", Unit::irradiance},
      std::pair{"objects_map", Unit::objects},           std::pair{"residual_ratio", Unit::residual},
      std::pair{"color_texture", Unit::color},           std::pair{"normal_texture", Unit::normal},
      std::pair{"split_sum_table", Unit::split_sum},     std::pair{"map_texels", Unit::map_texels}};
  for (const auto& [name, unit] : kSamplers) result.set(name, static_cast<int>(unit));
  return result;
}

GLint ShaderProgram::location(const char* uniform) const {
  const auto known = locations_.find(uniform);
  if (known != locations_.end()) return known->second;
  return locations_.emplace(uniform, glGetUniformLocation(program_.name(), uniform)).first->second;
}

void ShaderProgram::set(const char* uniform, int value) const { glUniform1i(location(uniform), value); }
void ShaderProgram::set(const char* uniform, float value) const { glUniform1f(location(uniform), value); }
void ShaderProgram::set(const char* uniform, const glm::ivec2& value) const {
  glUniform2iv(location(uniform), 1, glm::value_ptr(value));
}
void ShaderProgram::set(const char* uniform, const glm::vec2& value) const {
  glUniform2fv(location(uniform), 1, glm::value_ptr(value));
}
void ShaderProgram::set(const char* uniform, const glm::vec3& value) const {
  glUniform3fv(location(uniform), 1, glm::value_ptr(value));
}
void ShaderProgram::set(const char* uniform, const glm::mat3& value) const {
  glUniformMatrix3fv(location(uniform), 1, GL_FALSE, glm::value_ptr(value));
}
void ShaderProgram::set(const char* uniform, const glm::mat4& value) const {
  glUniformMatrix4fv(location(uniform), 1, GL_FALSE, glm::value_ptr(value));
}

}  // namespace lightwell::viewer
