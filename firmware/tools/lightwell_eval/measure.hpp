// Measures one case on one scene: time, instructions, bytes, errors.
#pragma once

#include <array>
#include <cstddef>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include <lightwell/result.hpp>

#include "tools/lightwell_eval/balls.hpp"
#include "tools/lightwell_eval/cases.hpp"
#include "tools/lightwell_eval/ground_truth.hpp"
#include "tools/lightwell_eval/rendered_brackets.hpp"

namespace lightwell::eval {

struct Outcome {
  double seconds = 0;  ///< Thread CPU time from frame to encoded bytes; mean over the buffers of each one's best pass.
  std::optional<double> instructions_per_pixel;
  double picture_bytes = 0;  ///< Size of the bracket that was timed.
  double bytes = 0;          ///< Encoded size of the descriptor whose errors are given, including a whole map.
  /// Irradiance error of proto/README.md, and the largest error of any normal and channel, both relative to the RMS.
  double rms = 0, largest = 0;
  std::optional<double> light_deg;  ///< Direction error; nullopt if the brightest region is below 100 times the mean.
  std::array<double, kBalls> balls{};
  double bound = 0;  ///< The descriptor's error bound; infinite if it has none.
  bool map = false;  ///< Whether the descriptor has a whole environment map.
};

/// Measures with 32 alternating buffers, so that no frame stays in a cache.
class Bench {
 public:
  explicit Bench(int passes) : passes_(passes) {}

  [[nodiscard]] Result<Outcome> measure(const Case& c, const GroundTruth& truth, const BallPictures& balls,
                                        const CameraRenderer& camera);

  /// Seconds of one memcpy between buffers, by number of bytes, measured in the same way; the minimum so far.
  [[nodiscard]] const std::map<std::size_t, double>& memcpy_seconds() const { return memcpy_seconds_; }

 private:
  [[nodiscard]] Status time(const Case& c, const RenderedBracket& bracket, Outcome& out);

  int passes_;
  std::vector<std::vector<std::byte>> buffers_;
  std::map<std::size_t, double> memcpy_seconds_;
};

}  // namespace lightwell::eval
