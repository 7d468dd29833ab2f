// Writes light estimates, colour temperatures and weights of C++, for comparison with the other languages.
//   FOLDER/estimates.txt
// A line is a word and numbers:
//   message HEX
//   estimate requested gain neutral_illuminance  validity available  the other fields of lw_light_estimate in order
//   temperature r g b  kelvin duv           0 0 where it has no meaning
//   fade age hold fade  weight              ns
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace lightwell::test {

/// Throws where it cannot write.
void write_estimate_answers(const std::filesystem::path& folder, const std::vector<std::string>& messages);

}  // namespace lightwell::test
