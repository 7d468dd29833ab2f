# The files of shaders/ as a part of the program. Sets shader_source to a C++ file that defines shader_source().
set(shader_source "${CMAKE_CURRENT_BINARY_DIR}/shader_source.cpp")
file(GLOB shader_files CONFIGURE_DEPENDS "${CMAKE_CURRENT_SOURCE_DIR}/shaders/*.glsl")
set(shader_entries)
foreach(file IN LISTS shader_files)
  get_filename_component(name "${file}" NAME)
  file(READ "${file}" text)
  string(APPEND shader_entries "    if (file == \"${name}\") return R\"glsl(${text})glsl\";\n")
endforeach()
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${shader_files})
file(CONFIGURE OUTPUT "${shader_source}" @ONLY CONTENT [=[
// Made by shaders.cmake from shaders/*.glsl.
#include "ar_viewer/shader_program.hpp"

namespace lightwell::viewer {

std::string_view shader_source(std::string_view file) {
@shader_entries@    return {};
}

}  // namespace lightwell::viewer
]=])
