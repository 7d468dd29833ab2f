// A V4L2 camera for tests, with a sink that records its frames.
#pragma once

#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "camera/backends/v4l2/control_delay.hpp"
#include "camera/backends/v4l2/v4l2_backend.hpp"
#include "firmware/camera/umock_camera.hpp"
#include "support/wait.hpp"

namespace lightwell::test {

inline Result<std::unique_ptr<V4l2Camera>> make_camera(const std::string& parameters,
                                                       const std::string& path = UmockCamera::path()) {
  const Result<CameraUri> uri = parse_camera_uri("v4l2:" + path + "?frame_rate=50&width=64&height=48" + parameters);
  if (!uri) return uri.status();
  Result<std::unique_ptr<CameraBackend>> made = make_v4l2_backend(*uri, CameraConfig());
  if (!made) return made.status();
  return std::unique_ptr<V4l2Camera>(static_cast<V4l2Camera*>(made->release()));
}

/// Status of making and opening a camera.
inline Status open_status(const std::string& parameters, const std::string& path = UmockCamera::path()) {
  const auto camera = make_camera(parameters, path);
  return camera ? (*camera)->open().status() : camera.status();
}

/// Records the metadata of frames and optionally holds them.
class RecordingSink final : public FrameSink {
 public:
  struct ReceivedFrame {
    FrameInfo info;
    double level = 0;  ///< mean_level() of the view.
    std::vector<unsigned>
        first_pixels;  ///< Values at the top left: 2 x 2 of a mosaic, otherwise the first three bytes.
  };

  void push(Frame frame) override {
    ReceivedFrame seen{frame.info, v4l2::mean_level(frame.views()[0]), corner(frame.views()[0])};
    if (on_frame) on_frame(frame);
    const std::lock_guard lock(mutex_);
    seen_.push_back(std::move(seen));
    if (kept_.size() < keep_) kept_.push_back(std::move(frame));
  }
  std::function<void(const Frame&)> on_frame;

  void keep(std::size_t frames) {
    const std::lock_guard lock(mutex_);
    keep_ = frames;
  }
  std::vector<Frame> take_kept() {
    const std::lock_guard lock(mutex_);
    keep_ = 0;
    return std::exchange(kept_, {});
  }
  [[nodiscard]] std::vector<ReceivedFrame> seen() const {
    const std::lock_guard lock(mutex_);
    return seen_;
  }
  [[nodiscard]] std::size_t count() const {
    const std::lock_guard lock(mutex_);
    return seen_.size();
  }
  [[nodiscard]] ::testing::AssertionResult more_come(std::size_t frames) const {
    const std::size_t wanted = count() + frames;
    return becomes_true(std::to_string(wanted) + " frames have come", [&] { return count() >= wanted; });
  }

 private:
  static std::vector<unsigned> corner(const View& view) {
    std::vector<unsigned> numbers;
    const auto at = [&](std::size_t i) { return std::to_integer<unsigned>(view.data[i]); };
    if (!is_bayer(view.format)) return {at(0), at(1), at(2)};
    const std::size_t size = pixel_layout(view.format).sample_bytes;
    for (const std::size_t i : {std::size_t{0}, size, view.stride, view.stride + size})
      numbers.push_back(size == 1 ? at(i) : at(i) | at(i + 1) << 8);
    return numbers;
  }

  mutable std::mutex mutex_;
  std::vector<ReceivedFrame> seen_;
  std::vector<Frame> kept_;
  std::size_t keep_ = 0;
};

/// An open camera with its sink. The sink outlives the camera's thread; held frames are released before the camera is
/// destroyed.
class OpenCamera {
 public:
  explicit OpenCamera(const std::string& parameters, const std::string& path = UmockCamera::path()) {
    auto made = make_camera(parameters, path);
    EXPECT_TRUE(made.ok()) << made.status().message();
    if (!made) return;
    camera = std::move(*made);
    const Result<CameraInfo> opened = camera->open();
    EXPECT_TRUE(opened.ok()) << opened.status().message();
    if (opened) info = *opened;
  }
  ~OpenCamera() {
    if (camera) camera->stop();
    (void)sink.take_kept();
  }
  OpenCamera(const OpenCamera&) = delete;
  OpenCamera& operator=(const OpenCamera&) = delete;

  [[nodiscard]] ::testing::AssertionResult start() {
    const Status s = camera->start(sink);
    return s.ok() ? ::testing::AssertionSuccess() : ::testing::AssertionFailure() << s.message();
  }
  [[nodiscard]] ::testing::AssertionResult becomes(CameraBackend::State state) const {
    return becomes_true("the camera's state is " + std::to_string(static_cast<int>(state)),
                        [&] { return camera->state() == state; });
  }
  [[nodiscard]] std::string notes() const {
    std::string all;
    for (const std::string& note : info.notes) all += note + "\n";
    return all;
  }

  CameraInfo info;
  RecordingSink sink;
  std::unique_ptr<V4l2Camera> camera;
};

}  // namespace lightwell::test
