// The descriptors whose bytes are kept in proto/vectors: one set for each wire version.
#pragma once

#include <lightwell/descriptor.hpp>
#include <string>
#include <vector>

namespace lightwell {

struct GoldenVector {
  std::string name;  ///< Of the files: NAME.bin and NAME.json.
  Descriptor descriptor;
};

[[nodiscard]] std::vector<GoldenVector> golden_vectors();

}  // namespace lightwell
