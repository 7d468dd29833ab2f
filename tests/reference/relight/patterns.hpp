// Patterns that a projector throws, as functions of the place on its picture plane.
#pragma once

#include <cstdint>

#include "reference/vector.hpp"

namespace lightwell::reference {

enum class LightPattern : std::uint8_t {
  none,           ///< The same light everywhere, in all directions.
  blinds,         ///< Venetian blinds: slats with soft edges, two cords.
  stained_glass,  ///< A rose window: coloured panes between lead lines.
};

/// Transmittance at (x, y), -1 to 1 across the picture's width, +y up. Black outside of the square, except `none`.
[[nodiscard]] Rgb transmittance(LightPattern pattern, double x, double y);

}  // namespace lightwell::reference
