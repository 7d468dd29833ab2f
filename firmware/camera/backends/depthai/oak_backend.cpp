#include <algorithm>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include <lightwell/text.hpp>

#include "camera/backend.hpp"
#include "camera/backends/depthai/oak_device.hpp"
#include "camera/bracket_cycle.hpp"

namespace lightwell::oak {
namespace {

using std::chrono::milliseconds;
using Clock = std::chrono::steady_clock;

constexpr milliseconds kFirstFrameTimeout{5000};
constexpr milliseconds kTick{100};
constexpr milliseconds kReconnectPeriod{1000};
/// A connected device without frames for this long is reconnected.
constexpr milliseconds kFrameTimeout{3000};
/// Maximum number of frames until an exposure takes effect, and the number assumed in a bracket.
constexpr int kMaxSettleFrames = 30, kFramesToReport = 5;
constexpr int kFramesForRate = 8;

ProbeTime now() { return {monotonic_now_ns()}; }

bool alike(double a, double b) { return std::abs(a - b) <= kExposureTolerance * b; }

std::string ms_text(double us) { return formatted("%.4g ms", 1e-3 * us); }

/// Assigns frames to the bracket, computes their times, and lends them.
class OakBackend final : public ThreadedBackend, public FrameOwner {
 public:
  OakBackend(OakOptions options, std::unique_ptr<OakDevice> device)
      : ThreadedBackend("depthai"), options_(std::move(options)), device_(std::move(device)) {}
  ~OakBackend() override { stop(); }

  [[nodiscard]] Result<CameraInfo> open() override {
    if (open_) return Status(StatusCode::failed_precondition, "depthai: the camera is open already");
    Result<std::string> name = device_->connect(options_);
    if (!name) return Status(name.status().code(), "depthai: " + name.status().message());
    info_ = {};
    info_.name = "depthai:" + *name;
    info_.width = options_.width;
    info_.height = options_.height;
    info_.format = options_.format;
    info_.notes = options_.notes;
    if (options_.row_readout.ns == 0)
      info_.notes.emplace_back(
          "all rows are assumed to be exposed at the same time; for a rolling shutter set row_readout=");
    if (Status s = measure_stream(); !s.ok()) {
      device_->disconnect();
      return Status(s.code(), "depthai: " + s.message());
    }
    const int lendable = required_buffer_count(static_cast<int>(info_.exposure_s.size()));
    slots_.resize(static_cast<std::size_t>(lendable));
    free_.reserve(slots_.size());
    returned_.reserve(slots_.size());
    for (int i = 0; i < lendable; ++i) free_.push_back(i);
    if (options_.format == PixelFormat::bayer_rggb10)
      for (Slot& slot : slots_)
        slot.words.resize(static_cast<std::size_t>(options_.width) * static_cast<std::size_t>(options_.height));
    cycle_.emplace(info_.exposure_s);
    held_.emplace(static_cast<int>(info_.exposure_s.size()), Duration{});
    open_ = true;
    return info_;
  }

  void release(int slot) override {
    const std::lock_guard lock(mutex_);
    returned_.push_back(slot);
  }

 private:
  struct Slot {
    OakPicture picture;                ///< Keeps the memory while it is lent.
    std::vector<std::uint16_t> words;  ///< Unpacked pixels of raw frames.
  };

  [[nodiscard]] Status measure_stream() {
    OakPicture picture, first;
    int frames = 0;
    const auto next = [&]() -> Status {
      if (device_->wait(picture, kFirstFrameTimeout) != OakDevice::WaitResult::picture)
        return {StatusCode::unavailable, "no frame came within 5 s: is its cable good, and a USB 3 one?"};
      if (Status s = check(picture); !s.ok()) return s;
      if (frames++ == 0) first = picture;
      return {};
    };
    for (const std::uint32_t asked : options_.exposure_us) {
      if (!device_->set_exposure(asked, options_.iso)) return {StatusCode::unavailable, "it was disconnected"};
      int tries = 0;
      do {
        if (Status s = next(); !s.ok()) return s;
      } while (!alike(picture.exposure_us, asked) && tries++ < kMaxSettleFrames);
      if (!alike(picture.exposure_us, asked))
        return {StatusCode::failed_precondition, "an exposure of " + ms_text(asked) +
                                                     " was requested, but it reports " + ms_text(picture.exposure_us) +
                                                     " after " + std::to_string(kMaxSettleFrames) +
                                                     " frames: request one that is possible at this frame rate"};
      info_.exposure_s.push_back(1e-6 * picture.exposure_us);
    }
    while (frames < kFramesForRate)
      if (Status s = next(); !s.ok()) return s;
    if (!mid_exposure(picture, options_.row_readout, now()))
      return {StatusCode::failed_precondition,
              "its timestamps are not of this host's clock: is time synchronisation off?"};
    const std::int64_t passed = picture.timestamp_ns - first.timestamp_ns, numbers = picture.sequence - first.sequence;
    interval_ =
        passed > 0 && numbers > 0 ? Duration{passed / numbers} : Duration::from_seconds(1 / options_.frame_rate);
    info_.frame_rate = 1 / interval_.seconds();
    if (info_.exposure_s.size() > 1) info_.frame_rate /= kFramesToReport;
    return {};
  }

  [[nodiscard]] Status check(const OakPicture& picture) const {
    if (picture.width != options_.width || picture.height != options_.height)
      return {StatusCode::failed_precondition,
              formatted("it gives pictures of %dx%d: set camera.width and camera.height to this size", picture.width,
                        picture.height)};
    const View view{0, options_.format, picture.width, picture.height, picture.stride, picture.data};
    if (options_.format == PixelFormat::nv12 &&
        (picture.plane_stride != picture.stride * static_cast<std::size_t>(picture.height) || !check_view(view).ok()))
      return {StatusCode::failed_precondition, "the planes of its nv12 are not contiguous in memory"};
    return {};
  }

  [[nodiscard]] bool is_open() const override { return open_; }

  void run(FrameSink& sink, const std::stop_token& stop) override {
    // Frames queued since the last run are outdated.
    discard_waiting();
    request_next_exposure();
    Clock::time_point heard = Clock::now();
    OakPicture picture;
    while (!stop.stop_requested()) {
      const OakDevice::WaitResult next = device_->wait(picture, kTick);
      const Clock::time_point woken = Clock::now();
      if (next == OakDevice::WaitResult::picture) {
        heard = woken;
        handle(std::exchange(picture, {}), sink);
        // The sink was slow: discard the frames queued meanwhile instead of delivering them in a burst.
        if (Clock::now() - woken > std::chrono::nanoseconds(2 * interval_.ns)) discard_waiting();
      } else if (next == OakDevice::WaitResult::gone || woken - heard > kFrameTimeout) {
        if (!reconnect(stop)) return;
        heard = Clock::now();
      }
    }
  }

  void discard_waiting() {
    OakPicture picture;
    while (device_->wait(picture, milliseconds(0)) == OakDevice::WaitResult::picture) {
    }
  }

  [[nodiscard]] bool reconnect(const std::stop_token& stop) {
    state_ = State::lost;
    device_->disconnect();
    while (true) {
      {
        std::unique_lock lock(mutex_);
        wake_.wait_for(lock, stop, kReconnectPeriod, [] { return false; });
        if (stop.stop_requested()) return false;
      }
      if (!device_->connect(options_).ok()) continue;
      // The device's frame counter has restarted.
      cycle_->restart();
      held_->restart();
      last_sequence_ = -1;
      request_next_exposure();
      state_ = State::streaming;
      return true;
    }
  }

  void handle(OakPicture picture, FrameSink& sink) {
    if (picture.sequence <= last_sequence_ || !check(picture).ok()) return;
    last_sequence_ = picture.sequence;
    const ProbeTime came = now();
    const std::optional<ProbeTime> mid = mid_exposure(picture, options_.row_readout, came);
    if (!mid || *mid <= last_mid_) return;
    const double exposure_s = 1e-6 * picture.exposure_us;
    const bool bracket = info_.exposure_s.size() > 1;
    if (bracket && !alike(exposure_s, info_.exposure_s[static_cast<std::size_t>(held_->index())])) return;
    const std::optional<int> slot = free_slot();
    if (!slot) {
      if (bracket) held_->skip();
      return;
    }
    Slot& held = slots_[static_cast<std::size_t>(*slot)];
    const bool raw = options_.format == PixelFormat::bayer_rggb10;
    std::optional<CyclePlace> place;
    if (!raw || unpack_raw10(picture, held.words).ok())
      place = bracket ? held_->take() : cycle_->place(static_cast<std::uint64_t>(picture.sequence), exposure_s);
    if (!place) return release(*slot);

    Frame frame(*this, *slot);
    const std::size_t stride = raw ? packed_stride(options_.format, picture.width) : picture.stride;
    const std::span<const std::byte> pixels =
        raw ? std::as_bytes(std::span(held.words))
            : picture.data.first(picture_bytes(options_.format, stride, picture.height));
    frame.add_view({0, options_.format, picture.width, picture.height, stride, pixels});
    FrameInfo& info = frame.info;
    info.sequence = place->sequence;
    info.bracket_index = place->index;
    info.bracket_size = static_cast<int>(info_.exposure_s.size());
    info.mid_exposure = last_mid_ = *mid;
    info.exposure_s = exposure_s;
    info.gain = picture.iso > 0 ? OakOptions::gain_of_iso(picture.iso) : options_.gain();
    info.row_readout = options_.row_readout;
    info.delivered = now();
    // The memory of a raw frame is no longer needed after unpacking.
    if (!raw) held.picture = std::move(picture);
    if (bracket) request_next_exposure();
    sink.push(std::move(frame));
  }

  [[nodiscard]] std::optional<int> free_slot() {
    const std::lock_guard lock(mutex_);
    for (const int slot : returned_) {
      slots_[static_cast<std::size_t>(slot)].picture = {};
      free_.push_back(slot);
    }
    returned_.clear();
    if (free_.empty()) return std::nullopt;
    const int slot = free_.back();
    free_.pop_back();
    return slot;
  }

  void request_next_exposure() {
    if (device_->set_exposure(options_.exposure_us[static_cast<std::size_t>(held_->index())], options_.iso))
      held_->exposure_requested(now());
  }

  const OakOptions options_;
  const std::unique_ptr<OakDevice> device_;
  CameraInfo info_;
  bool open_ = false;
  Duration interval_;

  std::mutex mutex_;  ///< Guards the two members below.
  std::vector<int> free_, returned_;
  std::condition_variable_any wake_;
  std::vector<Slot> slots_;

  // Owned by the thread while it runs
  std::optional<ReportedCycle> cycle_;  ///< Set for a single exposure.
  std::optional<HeldCycle> held_;       ///< Set for a bracket.
  std::int64_t last_sequence_ = -1;
  ProbeTime last_mid_;
};

}  // namespace

std::unique_ptr<CameraBackend> make_oak_backend(OakOptions options, std::unique_ptr<OakDevice> device) {
  return std::make_unique<OakBackend>(std::move(options), std::move(device));
}

}  // namespace lightwell::oak
