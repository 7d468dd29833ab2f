// One case on one scene: time, instructions, bytes, errors.
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
#include "tools/lightwell_eval/rendered_brackets.hpp"
#include "tools/lightwell_eval/ground_truth.hpp"

namespace lightwell::eval {

struct Outcome {
  double seconds = 0;  ///< From frame to encoded bytes, of one thread's time on a processor; mean of the buffers' best.
  std::optional<double> instructions_per_pixel;
  double picture_bytes = 0;  ///< Of the bracket that was timed.
  double bytes = 0;          ///< Encoded, of the descriptor that the errors are of; a whole map is in it.
  double rms = 0,
         largest =
             0;  ///< proto/README.md's error of irradiance, and the largest of any normal and channel, by the same RMS.
  std::optional<double> light_deg;  ///< None where the brightest region is below 100 times the mean.
  std::array<double, kBalls> balls{};
  double bound = 0;  ///< The descriptor's own; infinite where flagged.
  bool map = false;  ///< A whole environment map came.
};

/// 32 buffers that take turns, so that no cache holds a frame.
class Bench {
 public:
  explicit Bench(int passes) : passes_(passes) {}

  [[nodiscard]] Result<Outcome> measure(const Case& c, const GroundTruth& truth, const BallPictures& balls,
                                        const Camera& camera);

  /// Seconds of one memcpy of so many bytes from buffer to buffer, measured alike; the least of all cases so far.
  [[nodiscard]] const std::map<std::size_t, double>& memcpy_seconds() const { return memcpy_seconds_; }

 private:
  [[nodiscard]] Status time(const Case& c, const RenderedBracket& shot, Outcome& out);

  int passes_;
  std::vector<std::vector<std::byte>> buffers_;
  std::map<std::size_t, double> memcpy_seconds_;
};

}  // namespace lightwell::eval
