// One scene in one format: everything from the number of a picture and the settings of the sensor to bytes.
#pragma once

#include <cstdint>
#include <future>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include <lightwell/result.hpp>

#include "camera/backends/sim/lens_renderer.hpp"
#include "camera/backends/sim/sim_world.hpp"
#include "usb_camera/frame_source.hpp"

namespace lightwell::usb_camera {

/// render() may be called from any thread; the rest is constant.
class SceneRenderer {
 public:
  /// `uri` is the simulated camera's. Errors of parse_sim_options() and make_sim_world(); invalid_argument for a
  /// `sensor` in the URI or a lens that the rig has not.
  [[nodiscard]] static Result<std::shared_ptr<SceneRenderer>> open(const std::string& uri, int lens, int jpeg_quality,
                                                            const StreamFormat& format);

  [[nodiscard]] const StreamFormat& format() const { return format_; }
  [[nodiscard]] const RingPlan& plan() const { return world_->plan; }
  /// The URI's first exposure, or the one that suits the scene at gain 1.
  [[nodiscard]] double exposure_s() const { return world_->options.exposure_s.front(); }
  [[nodiscard]] double readout_s() const { return world_->options.readout_s; }
  /// What each pixel of a picture means: the truth, which the simulation knows.
  [[nodiscard]] RigParameters calibration() const;
  [[nodiscard]] const std::string& rig() const { return world_->options.rig; }

  /// Frame n shows picture plan().picture(n). internal where a JPEG cannot be made.
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
  std::unique_ptr<LensRenderer> renderer_;  ///< Built by the first picture: a host that only looks costs nothing.

  std::mutex mutex_;  ///< Guards what follows.
  /// Light of the frames rendered last, so that other exposures of them cost the sensor alone.
  std::list<std::pair<std::uint64_t, std::shared_future<Light>>> lights_;
  std::map<int, std::shared_ptr<const sim::Sensor>> sensors_;  ///< By colour temperature.
};

}  // namespace lightwell::usb_camera
