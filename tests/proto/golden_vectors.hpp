// The descriptors whose bytes are kept in proto/vectors: one set for each wire version.
#pragma once

#include <string>
#include <vector>

#include <lightwell/captured_plane.hpp>
#include <lightwell/descriptor.hpp>

namespace lightwell {

struct GoldenVector {
  std::string name;  ///< Of the files: NAME.bin and NAME.json.
  Descriptor descriptor;
};

[[nodiscard]] std::vector<GoldenVector> golden_vectors();

/// Whose first message is kept in captured_plane/v1_small.bin, with its texture.
[[nodiscard]] CapturedPlane golden_plane();

}  // namespace lightwell
