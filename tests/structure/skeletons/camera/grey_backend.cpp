#include "structure/skeletons/camera/grey_backend.hpp"

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "camera/uri_parameters.hpp"

namespace lightwell {
namespace {

using Clock = std::chrono::steady_clock;

constexpr double kExposure_s = 0.005;

class GreyBackend final : public CameraBackend, public FrameOwner {
 public:
  explicit GreyBackend(const CameraConfig& config) : config_(config) {}
  ~GreyBackend() override { stop(); }

  Result<CameraInfo> open() override {
    CameraInfo info;
    info.name = "grey";
    info.width = config_.width;
    info.height = config_.height;
    info.format = PixelFormat::rgb8;
    info.frame_rate = config_.frame_rate;
    info.exposure_s = {kExposure_s};
    // Frames share one picture, because it is never written again.
    stride_ = packed_stride(info.format, info.width);
    picture_.assign(picture_bytes(info.format, stride_, info.height), std::byte{128});
    return info;
  }

  Status start(FrameSink& sink) override {
    if (picture_.empty() || thread_.joinable()) return {StatusCode::failed_precondition, "grey: not open, or running"};
    stopping_ = false;
    state_ = State::streaming;
    thread_ = std::thread([this, &sink] { run(sink); });
    return {};
  }

  void stop() override {
    if (!thread_.joinable()) return;
    {
      const std::lock_guard lock(mutex_);
      stopping_ = true;
    }
    wake_.notify_all();
    thread_.join();
    state_ = State::idle;
  }

  State state() const override { return state_; }

  void release(int /*slot*/) override {
    const std::lock_guard lock(mutex_);
    --lent_;
  }

 private:
  void run(FrameSink& sink) {
    const auto interval =
        std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(1 / config_.frame_rate));
    for (Clock::time_point due = Clock::now() + interval;; due += interval) {
      std::unique_lock lock(mutex_);
      if (wake_.wait_until(lock, due, [this] { return stopping_; })) return;
      // Intervals that passed during a slow push() are skipped, not made up for in a burst.
      for (; due + interval < Clock::now(); due += interval) ++sequence_;
      const std::uint64_t sequence = sequence_++;
      if (lent_ == required_buffer_count(1)) continue;  // The gap of the sequence shows the lost frame.
      ++lent_;
      lock.unlock();  // push() may call release().
      push_frame(sink, sequence);
    }
  }

  void push_frame(FrameSink& sink, std::uint64_t sequence) {
    Frame frame(*this, 0);
    frame.info.sequence = sequence;
    frame.info.delivered = {monotonic_now_ns()};
    frame.info.mid_exposure = frame.info.delivered - Duration::from_seconds(kExposure_s / 2);
    frame.info.exposure_s = kExposure_s;
    frame.add_view({0, PixelFormat::rgb8, config_.width, config_.height, stride_, picture_});
    sink.push(std::move(frame));
  }

  const CameraConfig config_;
  std::size_t stride_ = 0;
  std::vector<std::byte> picture_;
  std::atomic<State> state_{State::idle};
  std::uint64_t sequence_ = 0;
  std::mutex mutex_;
  std::condition_variable wake_;
  bool stopping_ = false;
  int lent_ = 0;
  std::thread thread_;
};

}  // namespace

Result<std::unique_ptr<CameraBackend>> make_grey_backend(const CameraUri& uri, const CameraConfig& config) {
  const Result<UriParameters> parameters = read_parameters(uri, config, {.capture = {}, .own = {}, .renamed = {}});
  if (!parameters) return parameters.status();
  if (!(config.frame_rate > 0))
    return Status(StatusCode::invalid_argument, "grey: camera.frame_rate must be above zero");
  return std::unique_ptr<CameraBackend>(std::make_unique<GreyBackend>(config));
}

}  // namespace lightwell
