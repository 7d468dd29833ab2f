// How long an estimator takes from frame to encoded descriptor, beside memcpy of the same bytes in the same run.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include <lightwell/codec.hpp>
#include <lightwell/config.hpp>
#include <lightwell/pixel.hpp>

#include "camera/frame.hpp"
#include "estimate/estimator.hpp"
#include "sim/scene.hpp"

namespace lightwell::measure {

struct SpeedCase {
  std::string rig = "equirect";  ///< sim::make_rig's name.
  int width = 1280, height = 960;
  PixelFormat format = PixelFormat::rgb8;
  bool linear = false;  ///< Response of the sensor: linear, or as the rig has it.
  std::vector<double> exposures{1e-3};
  EstimatorConfig config;
  /// So many copies of the bracket take turns, so that no cache holds one. Fewer do for pictures of tens of megabytes.
  std::size_t buffers = 32;
};

struct Speed {
  double seconds = 0;         ///< Of one descriptor: each buffer at its best of the passes, and their mean.
  double memcpy_seconds = 0;  ///< Of copying the bytes of one bracket, in as many passes that take turns with those.
  double bytes = 0;           ///< Of one bracket.
  double descriptor_bytes = 0;
  int lights = 0;
};

/// One case; several that take turns pass by pass see the same good moments of a machine that is different from second
/// to second.
class SpeedBench {
 public:
  SpeedBench(const sim::Scene& scene, const SpeedCase& c);
  void pass();
  /// After at least one pass.
  [[nodiscard]] Speed best() const;

 private:
  std::vector<std::vector<std::byte>> buffers_;
  std::vector<std::vector<Frame>> frames_;  ///< Of the bytes in buffers_.
  std::unique_ptr<Estimator> estimator_;
  Encoder encoder_;
  Descriptor made_;
  std::vector<double> seconds_, memcpy_seconds_;  ///< Of each buffer, best of the passes so far.
  Speed shown_;                                   ///< All but the times.
};

/// Best of five passes.
[[nodiscard]] Speed measure_speed(const sim::Scene& scene, const SpeedCase& c);

}  // namespace lightwell::measure
