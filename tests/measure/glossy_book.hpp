// A glossy book with an AprilTag in each corner, in a room: frames of a hand-held camera for the replay camera, from
// which lightwelld estimates light and captures the book.
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <string>

#include <lightwell/glossy_plane.hpp>
#include <lightwell/result.hpp>

#include "measure/specular_sequences.hpp"

namespace lightwell::measure {

/// Tags 0 to 3 are at the top left, top right, bottom left and bottom right.
struct TaggedBook {
  /// Texels of the cover along a side, of a tag's cell, and between a tag and the cover's edge.
  static constexpr int kEdge = 256, kCell = 5, kMargin = 3;
  static constexpr double kTexel_m = SpecularSequence::kPlane_m / kEdge;

  GlossyPlane plane;
  reference::PlaneTexture albedo;
};
[[nodiscard]] Result<TaggedBook> tagged_book(std::uint64_t seed);

/// The book in tests/reference's living room (a window, two lamps, coloured walls), seen along a spiral whose lowest
/// views still show the tags large enough. The focal length is proportional to the width.
[[nodiscard]] Result<SpecularSequenceOptions> book_sequence(int frames, int width, int height);

/// Which frame of write_replay() a loop shows as its number `played`: forth and back, so that the camera never jumps.
[[nodiscard]] inline int replayed_frame(std::uint64_t played, int frames) {
  const auto period = static_cast<std::uint64_t>(std::max(1, 2 * frames - 2));
  const int k = static_cast<int>(played % period);
  return k < frames ? k : 2 * frames - 2 - k;
}

/// Writes the first `frames` of a sequence as PNG, played forth and back every `period_s`, with frames.csv,
/// calibration.textproto and book.textproto into an existing folder, for replay:FOLDER. Renders on all processors.
/// `progress`: called with the number of frames written, by one thread at a time; may be empty. The error names the
/// file.
[[nodiscard]] Status write_replay(const SpecularSequence& sequence, int frames, const GlossyPlane& plane,
                                  const std::string& folder, double period_s = 1 / 30.0,
                                  const std::function<void(int)>& progress = {});

}  // namespace lightwell::measure
