// Tags for the peer of bench/straughn2018.hpp, from the project's own TagDetector, which stands in for ARToolkit:
// its numbers are not mistaken and its corners are better, which favours the seed.
#pragma once

#include <cstdint>
#include <vector>

#include <lightwell/result.hpp>

#include "bench/straughn2018.hpp"
#include "pose/tag_detector.hpp"

namespace lightwell::bench {

struct StraughnTagOptions {
  TagFamily family = TagFamily::tag36h11;
  StraughnEncoding encoding = StraughnEncoding::srgb;  ///< Of the picture.
  /// Section 4.1.2: one pass over a black and white picture for each of these thresholds, 0 to 255; a tag is kept from
  /// the first pass that finds it. Empty: one pass over the grey picture as it is, which finds more and whose corners
  /// are refined. The seed's passes are there for what they cost: accuracy is measured with the grey picture.
  std::vector<int> thresholds;
};

/// "Four passes" (5.2.1) with the values that 5.2.3 calls stable: 30 to 45 for white bodies, 50 to 60 for grey ones.
[[nodiscard]] inline std::vector<int> straughn_four_passes() { return {30, 40, 50, 60}; }

/// One thread, one call at a time.
class StraughnTagDetector {
 public:
  [[nodiscard]] static Result<StraughnTagDetector> make(const StraughnTagOptions& options = {});

  /// invalid_argument: a picture that does not hold its bytes.
  [[nodiscard]] Result<std::vector<StraughnTag>> detect(const StraughnPicture& picture);

 private:
  StraughnTagDetector(StraughnTagOptions options, TagDetector detector);
  [[nodiscard]] Status look(const StraughnPicture& picture, const std::vector<std::uint8_t>& grey, std::vector<StraughnTag>& tags);

  StraughnTagOptions options_;
  TagDetector detector_;
  std::vector<std::uint8_t> grey_, binary_;
};

}  // namespace lightwell::bench
