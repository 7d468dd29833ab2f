// Writes what LightField of C++ answers, for comparison with the other languages.
//   FOLDER/fields.txt
// A line is a word and numbers:
//   field                                a new one, with the default options
//   sample NAME px py pz qx qy qz qw position_sigma orientation_sigma mid_exposure_ns HEX
//   triangle x y z  x y z  x y z         of its geometry, which is set when the next update comes
//   update now_ns  lights probes units   units: 1 relative, 2 absolute
//   light id placed probes  px py pz  covariance (6)  dx dy dz sigma  r g b  gradient (9)  radius
//   probe NAME state  px py pz  scale lights matched ambiguous
//   at px py pz now_ns  validity age_ns error_bound flags field_flags nearest_probe  lights band
//   irradiance px py pz nx ny nz now_ns  validity r g b
#pragma once

#include <filesystem>

namespace lightwell::test {

/// Throws where it cannot write.
void write_field_answers(const std::filesystem::path& folder);

}  // namespace lightwell::test
