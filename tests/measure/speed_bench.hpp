// Measures the time of an estimator from frame to encoded descriptor, and of memcpy of the same bytes in the same run.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include <lightwell/codec.hpp>
#include <lightwell/estimator_config.hpp>
#include <lightwell/pixel.hpp>

#include "estimate/estimator.hpp"
#include "imaging/frame.hpp"
#include "sim/scene.hpp"

namespace lightwell::measure {

struct SpeedCase {
  std::string rig = "equirect";  ///< Name for sim::make_rig.
  int width = 1280, height = 960;
  PixelFormat format = PixelFormat::rgb8;
  bool linear = false;  ///< Linear response; otherwise the rig's response.
  std::vector<double> exposures{1e-3};
  EstimatorConfig config;
  /// Number of copies of the bracket that are used in turn, so that none stays in a cache. Fewer suffice for images of
  /// tens of megabytes.
  std::size_t buffers = 32;
};

struct Speed {
  double seconds = 0;         ///< Time per descriptor: mean over the buffers of each buffer's best pass.
  double memcpy_seconds = 0;  ///< Time to copy the bytes of one bracket, measured in alternating passes.
  double bytes = 0;           ///< Size of one bracket.
  double descriptor_bytes = 0;
  int lights = 0;
};

/// Measures one case. Alternating the passes of several cases makes them comparable on a machine whose speed varies.
class SpeedBench {
 public:
  SpeedBench(const sim::Scene& scene, const SpeedCase& c);
  void pass();
  /// The best of the passes so far, of which there must be at least one.
  [[nodiscard]] Speed best() const;

 private:
  std::vector<std::vector<std::byte>> buffers_;
  std::vector<std::vector<Frame>> frames_;  ///< Refer to buffers_.
  std::unique_ptr<Estimator> estimator_;
  Encoder encoder_;
  Descriptor made_;
  std::vector<double> seconds_, memcpy_seconds_;  ///< Best time of each buffer so far.
  Speed shown_;                                   ///< Without the times.
};

/// Best of five passes.
[[nodiscard]] Speed measure_speed(const sim::Scene& scene, const SpeedCase& c);

}  // namespace lightwell::measure
