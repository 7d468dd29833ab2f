// Renders one scene in one format: from the number of an image and the sensor settings to bytes.
#pragma once

#include <array>
#include <cstdint>
#include <future>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include <lightwell/result.hpp>

#include "camera/backends/sim/sim_backend.hpp"
#include "usb_camera/controls.hpp"

namespace lightwell::usb_camera {

/// PhotometricCalibration::white_balance of a camera that renders a black body of this temperature as grey: the black
/// body's linear Rec. 709 red, green and blue relative to those of a black body of 6500 K, normalized to green 1;
/// exactly 1, 1, 1 at 6500 K. Valid from 1667 to 25000 K: cubic splines of the Planckian locus, Kim et al. 2002, US
/// patent 7024034.
[[nodiscard]] std::array<double, 3> white_balance(double kelvin);

/// Baseline JPEG, 4:2:2, as USB cameras send it. `rgb`: 3 bytes per pixel, rows without padding. `quality`: libjpeg's,
/// 1 to 95; it is lowered in steps of 5 until the image has at most `max_bytes` bytes. internal: libjpeg fails, or no
/// quality suffices.
[[nodiscard]] Result<std::vector<std::byte>> encode_jpeg(std::span<const std::byte> rgb, FrameSize size, int quality,
                                                         std::size_t max_bytes);

/// render() may be called from any thread; the rest is constant.
class SceneRenderer {
 public:
  /// `uri`: URI of the simulated camera. Errors of parse_sim_options() and make_sim_world(); invalid_argument for
  /// `sensor` or `gain` in the URI, which the host sets, or a lens index that the rig does not have.
  [[nodiscard]] static Result<std::shared_ptr<SceneRenderer>> open(const std::string& uri, int lens, int jpeg_quality,
                                                                   const StreamFormat& format);

  [[nodiscard]] const StreamFormat& format() const { return format_; }
  [[nodiscard]] const RingPlan& plan() const { return world_->plan; }
  /// The first exposure time of the URI, or the automatic one at gain 1, in seconds.
  [[nodiscard]] double exposure_s() const { return world_->options.capture.exposure_s.front(); }
  [[nodiscard]] double readout_s() const { return world_->options.row_readout_s; }
  /// The true calibration of the images.
  [[nodiscard]] RigParameters calibration() const;
  [[nodiscard]] const std::string& rig() const { return world_->options.rig; }
  /// Former names of parameters in the URI.
  [[nodiscard]] const std::vector<std::string>& notes() const { return world_->options.notes; }

  /// Renders an image; frame n shows image plan().picture(n). internal: JPEG encoding fails.
  [[nodiscard]] Result<std::vector<std::byte>> render(std::uint64_t picture, const SensorSettings& settings);

 private:
  using Light = std::shared_ptr<const std::vector<float>>;

  SceneRenderer(std::unique_ptr<SimWorld> world, int lens, int jpeg_quality, const StreamFormat& format);
  [[nodiscard]] Light light(std::uint64_t index);
  [[nodiscard]] const LensRenderer& renderer();
  [[nodiscard]] std::shared_ptr<const sim::Sensor> sensor(int kelvin);

  std::unique_ptr<SimWorld> world_;
  std::size_t lens_;
  int jpeg_quality_;
  StreamFormat format_;

  std::once_flag built_;
  std::unique_ptr<LensRenderer>
      renderer_;  ///< Built for the first image, so that a host that only enumerates costs nothing.

  std::mutex mutex_;  ///< Guards what follows.
  /// Radiance of the latest frames, most recent first: other exposures of them need only the sensor model.
  std::list<std::pair<std::uint64_t, std::shared_future<Light>>> lights_;
  std::map<int, std::shared_ptr<const sim::Sensor>> sensors_;  ///< By colour temperature.
};

}  // namespace lightwell::usb_camera
