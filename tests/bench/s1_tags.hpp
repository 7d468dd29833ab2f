// Tags for the peer of bench/s1_dodecahedron.hpp, from the project's own TagDetector, which stands in for ARToolkit:
// its numbers are not mistaken and its corners are better, which favours the seed.
#pragma once

#include <cstdint>
#include <vector>

#include <lightwell/result.hpp>

#include "bench/s1_dodecahedron.hpp"
#include "pose/tag_detector.hpp"

namespace lightwell::bench {

struct S1TagOptions {
  TagFamily family = TagFamily::tag36h11;
  S1Encoding encoding = S1Encoding::srgb;  ///< Of the picture.
  /// Section 4.1.2: one pass over a black and white picture for each of these thresholds, 0 to 255; a tag is kept from
  /// the first pass that finds it. Empty: one pass over the grey picture as it is, which finds more and whose corners
  /// are refined. The seed's passes are there for what they cost: accuracy is measured with the grey picture.
  std::vector<int> thresholds;
};

/// "Four passes" (5.2.1) with the values that 5.2.3 calls stable: 30 to 45 for white bodies, 50 to 60 for grey ones.
[[nodiscard]] inline std::vector<int> s1_four_passes() { return {30, 40, 50, 60}; }

/// One thread, one call at a time.
class S1TagDetector {
 public:
  [[nodiscard]] static Result<S1TagDetector> make(const S1TagOptions& options = {});

  /// invalid_argument: a picture that does not hold its bytes.
  [[nodiscard]] Result<std::vector<S1Tag>> detect(const S1Picture& picture);

 private:
  S1TagDetector(S1TagOptions options, TagDetector detector);
  [[nodiscard]] Status look(const S1Picture& picture, const std::vector<std::uint8_t>& grey, std::vector<S1Tag>& tags);

  S1TagOptions options_;
  TagDetector detector_;
  std::vector<std::uint8_t> grey_, binary_;
};

}  // namespace lightwell::bench
