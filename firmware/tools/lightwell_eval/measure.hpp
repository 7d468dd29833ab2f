// The cases of the sweep: cameras and configurations of the estimator. Measures one case on one scene: time,
// instructions, bytes, errors. The frames are simulated pictures of a panorama.
#pragma once

#include <array>
#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <lightwell/calibration.hpp>
#include <lightwell/estimator_config.hpp>
#include <lightwell/pixel.hpp>

#include "imaging/frame.hpp"
#include "sim/scene.hpp"
#include "tools/lightwell_eval/ground_truth.hpp"

namespace lightwell::eval {

/// The sensor for the error. Times are always measured with rgb8 pictures.
enum class Sensor {
  ideal,      ///< Floating-point radiance without noise: the error of the estimator alone.
  eight_bit,  ///< rgb8 with noise, vignetting and saturation.
};

struct Case {
  std::string label;
  std::string_view parameter = "setting";  ///< What the case varies; determines its colour in the chart.
  int width = 640, height = 480;           ///< Of each picture of the pair.
  Sensor sensor = Sensor::ideal;
  int exposures = 1;
  int block_edge = 0;  ///< PanoramaOptions::block_edge.
  EstimatorConfig config;
  bool named = false;  ///< One of the named settings.

  /// Whether both cases have the same camera and sensor, so that they are compared.
  [[nodiscard]] bool competes_with(const Case& o) const {
    return width == o.width && height == o.height && sensor == o.sensor;
  }
};

[[nodiscard]] std::vector<Case> all_cases();

/// One bracket of a pair of lenses back to back, in contiguous memory.
struct RenderedBracket {
  RigParameters rig;
  PixelFormat format = PixelFormat::rgb8;
  std::vector<double> exposures;
  std::vector<std::byte> bytes;
  std::vector<std::size_t> offsets;  ///< Offset of each picture in `bytes`: by exposure, then by lens.

  /// Frames that refer to `memory`, which has the layout of `bytes`. `number`: index of the capture at 30 per second.
  [[nodiscard]] std::vector<Frame> frames(std::span<const std::byte> memory, std::uint64_t number) const;
};

/// Renders the radiance of a camera's lenses once; exposes it any number of times. Throws InputError, as Bench.
class CameraRenderer {
 public:
  /// Takes about two seconds for 2 x 1280x960.
  CameraRenderer(const sim::Scene& scene, int width, int height);

  /// Sensor::ideal: one exposure of one second. Sensor::eight_bit: a single exposure saturates the brightest 1 % of the
  /// panorama; a bracket ranges from an exposure for the peak to that one.
  [[nodiscard]] RenderedBracket bracket(Sensor sensor, int exposures) const;

 private:
  int width_ = 0, height_ = 0;
  double bright_ = 0, peak_ = 0;
  std::vector<std::vector<float>> radiance_;  ///< By lens.
};

struct Outcome {
  double seconds = 0;  ///< Thread CPU time from frame to encoded bytes; mean over the buffers of each one's best pass.
  std::optional<double> instructions_per_pixel;
  std::size_t picture_bytes = 0;  ///< Size of the bracket that was timed.
  double bytes = 0;               ///< Encoded size of the descriptor whose errors are given, including a whole map.
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

  [[nodiscard]] Outcome measure(const Case& c, const GroundTruth& truth, const BallPictures& balls,
                                const CameraRenderer& camera);

  /// Seconds of one memcpy between buffers, by number of bytes, measured in the same way; the minimum so far.
  [[nodiscard]] const std::map<std::size_t, double>& memcpy_seconds() const { return memcpy_seconds_; }

 private:
  void time(const Case& c, const RenderedBracket& bracket, Outcome& out);

  int passes_;
  std::vector<std::vector<std::byte>> buffers_;
  std::map<std::size_t, double> memcpy_seconds_;
};

}  // namespace lightwell::eval
