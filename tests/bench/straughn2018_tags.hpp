// Tags for the peer of bench/straughn2018.hpp, from Lightwell's TagDetector instead of ARToolkit: it does not confuse
// numbers, and its corners are more accurate, which favours the thesis.
#pragma once

#include <cstdint>
#include <vector>

#include <lightwell/result.hpp>

#include "bench/straughn2018.hpp"
#include "pose/tag_detector.hpp"

namespace lightwell::bench {

struct StraughnTagOptions {
  TagFamily family = TagFamily::tag36h11;
  StraughnEncoding encoding = StraughnEncoding::srgb;  ///< Encoding of the image.
  /// Section 4.1.2: one pass over a binary image for each of these thresholds, 0 to 255; a tag is kept from the first
  /// pass that finds it. Empty: one pass over the grey image, which finds more tags and refines corners. The thesis's
  /// passes are only used to measure time; accuracy is measured with the grey image.
  std::vector<int> thresholds;
};

/// "Four passes" (5.2.1) with the values that 5.2.3 calls stable: 30 to 45 for white bodies, 50 to 60 for grey ones.
[[nodiscard]] inline std::vector<int> straughn_four_passes() { return {30, 40, 50, 60}; }

/// Not thread-safe; uses one thread.
class StraughnTagDetector {
 public:
  [[nodiscard]] static Result<StraughnTagDetector> make(const StraughnTagOptions& options = {});

  /// invalid_argument: the data is smaller than the image.
  [[nodiscard]] Result<std::vector<StraughnTag>> detect(const StraughnPicture& picture);

 private:
  StraughnTagDetector(StraughnTagOptions options, TagDetector detector);
  [[nodiscard]] Status detect_pass(const StraughnPicture& picture, const std::vector<std::uint8_t>& grey,
                                   std::vector<StraughnTag>& tags);

  StraughnTagOptions options_;
  TagDetector detector_;
  std::vector<std::uint8_t> grey_, binary_;
};

}  // namespace lightwell::bench
