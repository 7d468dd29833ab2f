// Writes cube maps of C++, for comparison with the other languages.
//   FOLDER/cube_maps.txt
// A line is a word and numbers, %.9g:
//   message HEX
//   cube edge lights(0,1) scale clamped  r g b ...     CubeFormat::rgba32f, all texels in order
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace lightwell::test {

/// Throws where it cannot write.
void write_cube_answers(const std::filesystem::path& folder, const std::vector<std::string>& messages);

}  // namespace lightwell::test
