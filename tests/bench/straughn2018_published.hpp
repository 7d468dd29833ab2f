// Results published in the thesis of bench/straughn2018.hpp, with a lamp at a distance of two feet: percent of 180
// degrees, and the place in its text.
#pragma once

#include <array>

namespace lightwell::bench {

struct StraughnPublished {
  const char* what;   ///< Identifier.
  double percent;     ///< Error of the light's direction in percent of 180 degrees.
  const char* where;  ///< Section and paragraph.

  [[nodiscard]] constexpr double degrees() const { return percent * 1.8; }
};

// A case is a body (white or grey), a view (straight: a face towards the camera; turned: an edge) and a place of the
// lamp. Ten light vectors of each case were averaged before comparison with the truth (4.3).

/// Mean and median over all twenty cases.
inline constexpr StraughnPublished kStraughnMean{"mean", 37.49, "5.2.2, first paragraph: 67.48 deg"};
inline constexpr StraughnPublished kStraughnMedian{"median", 33.34, "5.2.2, first paragraph: 60.01 deg"};

/// Mean over the four cases of each place of the lamp.
inline constexpr std::array kStraughnByLamp = {
    StraughnPublished{"front", 36.98, "5.2.2, paragraph below figure 9"},
    StraughnPublished{"front_right", 34.72, "5.2.2, paragraph below figure 9"},
    StraughnPublished{"right", 25.92, "5.2.2, paragraph below figure 9"},
    StraughnPublished{"back_right", 29.18, "5.2.2, paragraph below figure 9"},
    StraughnPublished{"behind", 60.63, "5.2.2, paragraph below figure 9"},
};

/// Mean over the five cases of each body and view.
inline constexpr std::array kStraughnByView = {
    StraughnPublished{"grey.straight", 43.16, "5.2.2, second paragraph"},
    StraughnPublished{"grey.turned", 31.63, "5.2.2, second paragraph"},
    StraughnPublished{"white.straight", 38.19, "5.2.2, second paragraph"},
    StraughnPublished{"white.turned", 36.97, "5.2.2, second paragraph"},
};

}  // namespace lightwell::bench
