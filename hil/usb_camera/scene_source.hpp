// Renders images with the firmware's scene and sensor model, in advance in background threads, and caches them: the
// same bytes that the simulated camera (firmware/camera/backends/sim) delivers with the same options.
#pragma once

#include <array>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <future>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <span>
#include <string>
#include <thread>
#include <tuple>
#include <vector>

#include "camera/backends/sim/sim_backend.hpp"
#include "usb_camera/stream.hpp"

namespace lightwell::usb_camera {

/// PhotometricCalibration::white_balance of a camera that renders a black body of this temperature as grey: the black
/// body's linear Rec. 709 red, green and blue relative to those of a black body of 6500 K, normalized to green 1;
/// exactly 1, 1, 1 at 6500 K. Valid from 1667 to 25000 K: cubic splines of the Planckian locus, Kim et al. 2002, US
/// patent 7024034.
[[nodiscard]] std::array<double, 3> white_balance(double kelvin);

/// Baseline JPEG, 4:2:2, as USB cameras send it. `rgb`: 3 bytes per pixel, rows without padding. `quality`: libjpeg's,
/// 1 to 95; it is lowered in steps of 5 until the image has at most `max_bytes` bytes. Errors of encode_jpeg()
/// (imaging/jpeg_encoder.hpp); internal: no quality suffices.
[[nodiscard]] Result<std::vector<std::byte>> encode_mjpeg(std::span<const std::byte> rgb, FrameSize size, int quality,
                                                          std::size_t max_bytes);

/// Renders one scene in one format: from the number of an image and the sensor settings to bytes. render() may be
/// called from any thread; the rest is constant.
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

struct SceneOptions {
  std::string uri =
      "sim:city?rig=single";  ///< URI of the simulated camera, without sensor= and gain=, which the host sets.
  int lens = 0;               ///< Index of the lens in the rig; a USB camera has one lens.
  int jpeg_quality = 90;
  int threads = 2;                            ///< Number of rendering threads.
  std::size_t memory = std::size_t{1} << 30;  ///< Bytes of cached images; the least recently used are dropped.
};

struct RenderCounts {
  std::uint64_t rendered = 0;
  std::uint64_t kept = 0, kept_bytes = 0;
  double render_s = 0;  ///< Total rendering time.
  std::uint64_t failed = 0;
};

class SceneSource final : public FrameSource {
 public:
  /// `ready` is called from a rendering thread after each image; it must return at once. Errors of parse_sim_options()
  /// and of reading the scene.
  [[nodiscard]] static Result<std::unique_ptr<SceneSource>> open(SceneOptions options, std::function<void()> ready);
  ~SceneSource() override;

  /// Changes the scene, in the current format; cached images of the old one are dropped. Reads a file, which takes a
  /// tenth of a second. After an error nothing has changed.
  [[nodiscard]] Status set_scene(const std::string& uri);
  /// Renders all images of a stream's cycle in this format with each of these exposure times, and waits for them. An
  /// empty `exposure_s` stands for the automatic exposure time.
  [[nodiscard]] Status render_ahead(const StreamFormat& format, const std::vector<double>& exposure_s);

  [[nodiscard]] Status configure(const StreamFormat& format) override;
  [[nodiscard]] double automatic_exposure_s() const override;
  [[nodiscard]] double readout_s() const override;
  [[nodiscard]] Picture picture(std::uint64_t number, const SensorSettings& settings) override;
  void order(std::uint64_t number, const SensorSettings& settings) override;

  [[nodiscard]] RenderCounts counts() const;
  [[nodiscard]] const std::string& uri() const { return options_.uri; }
  /// Former names of parameters in the scene's URI.
  [[nodiscard]] const std::vector<std::string>& notes() const { return renderers_.front().second->notes(); }

 private:
  /// Number of the renderer, number of the image, exposure in nanoseconds, gain in thousandths, white balance in
  /// kelvin.
  using Key = std::tuple<std::uint64_t, std::uint64_t, std::int64_t, std::int64_t, int>;
  struct Kept {
    Picture picture;
    std::uint64_t used = 0;
  };
  struct Job {
    Key key;
    std::shared_ptr<SceneRenderer> renderer;
    std::uint64_t picture = 0;
    SensorSettings settings;
  };

  SceneSource(SceneOptions options, std::function<void()> ready, std::uint64_t serial,
              std::shared_ptr<SceneRenderer> renderer);
  [[nodiscard]] Job job(std::uint64_t number, const SensorSettings& settings) const;
  void enqueue(Job job, bool first);
  void work();
  void keep(const Key& key, Picture picture);

  SceneOptions options_;
  std::function<void()> ready_;
  /// Renderers of the formats used last, most recent first; their numbers identify their images in the cache.
  std::deque<std::pair<std::uint64_t, std::shared_ptr<SceneRenderer>>> renderers_;
  std::uint64_t next_renderer_ = 1;

  mutable std::mutex mutex_;  ///< Guards what follows.
  std::condition_variable wake_, finished_;
  bool stopping_ = false;
  std::deque<Job> jobs_;
  std::set<Key> pending_;  ///< Queued or being rendered.
  std::map<Key, Kept> kept_;
  std::uint64_t clock_ = 0;
  RenderCounts counts_;
  std::vector<std::thread> threads_;
};

}  // namespace lightwell::usb_camera
