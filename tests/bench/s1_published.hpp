// What the seed of bench/s1_dodecahedron.hpp measured of itself, with a lamp two feet away: percent of 180 degrees, and
// where its text says so.
#pragma once

#include <array>

namespace lightwell::bench {

struct S1Published {
  const char* what;   ///< A name for programs.
  double percent;     ///< Error of the light's direction, of 180 degrees.
  const char* where;  ///< Section and paragraph.

  [[nodiscard]] constexpr double degrees() const { return percent * 1.8; }
};

// A case is a body (white or grey), a way to see it (straight: a face towards the camera; turned: an edge) and a place
// of the lamp. Ten light vectors of each were averaged before they were compared with the truth (4.3).

/// Over all twenty cases, and their median.
inline constexpr S1Published kS1Mean{"mean", 37.49, "5.2.2, first paragraph: 67.48 deg"};
inline constexpr S1Published kS1Median{"median", 33.34, "5.2.2, first paragraph: 60.01 deg"};

/// Mean of the four cases of a place of the lamp.
inline constexpr std::array kS1ByLamp = {
    S1Published{"front", 36.98, "5.2.2, paragraph below figure 9"},
    S1Published{"front_right", 34.72, "5.2.2, paragraph below figure 9"},
    S1Published{"right", 25.92, "5.2.2, paragraph below figure 9"},
    S1Published{"back_right", 29.18, "5.2.2, paragraph below figure 9"},
    S1Published{"behind", 60.63, "5.2.2, paragraph below figure 9"},
};

/// Mean of the five cases of a body and a way to see it.
inline constexpr std::array kS1ByView = {
    S1Published{"grey.straight", 43.16, "5.2.2, second paragraph"},
    S1Published{"grey.turned", 31.63, "5.2.2, second paragraph"},
    S1Published{"white.straight", 38.19, "5.2.2, second paragraph"},
    S1Published{"white.turned", 36.97, "5.2.2, second paragraph"},
};

}  // namespace lightwell::bench
