// Renders images with the firmware's scene and sensor model, in advance in background threads, and caches them: the
// same bytes that the simulated camera (firmware/camera/backends/sim) delivers with the same options.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <tuple>
#include <vector>

#include "usb_camera/scene_renderer.hpp"
#include "usb_camera/stream.hpp"

namespace lightwell::usb_camera {

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
