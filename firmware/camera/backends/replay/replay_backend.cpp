#include "camera/backends/replay/replay_backend.hpp"

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include <lightwell/text.hpp>

#include "camera/backends/replay/source.hpp"
#include "camera/backends/replay/timeline.hpp"
#include "camera/uri_parameters.hpp"

namespace lightwell {
namespace {

using replay::Source;
using replay::StoredFrame;
using replay::Timeline;

enum class Pace { recorded, fast };

struct Options {
  std::string path;
  int loops = 1;  ///< 0: endlessly.
  Pace pace = Pace::recorded;
};

/// Slots read ahead, to bridge short stalls of the disk.
constexpr int kReadAhead = 4;

ProbeTime now() { return {monotonic_now_ns()}; }

/// Frame buffers of a replay: a reader fills slots, a player lends them, and consumers release them.
///   free -> (reader fills) -> ready -> (player lends) -> lent -> (holder releases) -> free
/// Thread-safe. After a request to stop, waiting methods return at once.
class FrameSlots final : public FrameOwner {
 public:
  /// At most `lendable` slots are lent at the same time; with `read_ahead` more the reader can continue meanwhile.
  FrameSlots(int lendable, int read_ahead)
      : frames_(static_cast<std::size_t>(lendable + read_ahead)), lendable_(lendable) {
    free_.reserve(frames_.size());
    ready_.reserve(frames_.size());
    for (int i = 0; i < lendable + read_ahead; ++i) free_.push_back(i);
  }

  /// Begins a new run without ready slots. Lent slots stay lent.
  void begin() {
    const std::lock_guard lock(mutex_);
    free_.insert(free_.end(), ready_.begin(), ready_.end());
    ready_.clear();
    ended_ = false;
  }

  static constexpr int kNone = -1;

  // The reader's side.
  /// Waits for a free slot; kNone on stop.
  [[nodiscard]] int wait_free(const std::stop_token& stop) {
    std::unique_lock lock(mutex_);
    if (!changed_.wait(lock, stop, [this] { return !free_.empty(); }) || stop.stop_requested()) return kNone;
    const int slot = free_.back();
    free_.pop_back();
    return slot;
  }
  void make_ready(int slot) {
    const std::lock_guard lock(mutex_);
    ready_.push_back(slot);
    changed_.notify_all();
  }
  /// No more slots will become ready in this run.
  void end() {
    const std::lock_guard lock(mutex_);
    ended_ = true;
    changed_.notify_all();
  }

  // The player's side.
  struct Ready {
    int slot = kNone;   ///< kNone: at the end, or stopped.
    bool late = false;  ///< The player had to wait for the reader.
  };
  [[nodiscard]] Ready wait_ready(const std::stop_token& stop) {
    std::unique_lock lock(mutex_);
    Ready ready{kNone, ready_.empty()};
    changed_.wait(lock, stop, [this] { return ended_ || !ready_.empty(); });
    if (stop.stop_requested() || ready_.empty()) return ready;
    ready.slot = ready_.front();
    ready_.erase(ready_.begin());
    return ready;
  }
  /// Waits until `due`; false if stopped before.
  [[nodiscard]] bool wait_until(ProbeTime due, const std::stop_token& stop) {
    // steady_clock is CLOCK_MONOTONIC on Linux, the probe's clock.
    const std::chrono::steady_clock::time_point when{std::chrono::nanoseconds(due.ns)};
    std::unique_lock lock(mutex_);
    changed_.wait_until(lock, stop, when, [] { return false; });
    return !stop.stop_requested();
  }
  [[nodiscard]] bool may_lend() {
    const std::lock_guard lock(mutex_);
    return lent_ < lendable_;
  }
  /// Waits until a slot may be lent; false on stop.
  [[nodiscard]] bool wait_may_lend(const std::stop_token& stop) {
    std::unique_lock lock(mutex_);
    return changed_.wait(lock, stop, [this] { return lent_ < lendable_; }) && !stop.stop_requested();
  }
  /// Requires may_lend(). Called by the one thread that lends.
  [[nodiscard]] Frame lend(int slot) {
    {
      const std::lock_guard lock(mutex_);
      ++lent_;
    }
    const StoredFrame& stored = frame(slot);
    Frame out(*this, slot);
    for (std::size_t i = 0; i < stored.view_count; ++i) out.add_view(stored.views[i]);
    return out;
  }
  /// Frees a slot without lending it.
  void drop(int slot) {
    const std::lock_guard lock(mutex_);
    free_.push_back(slot);
    changed_.notify_all();
  }
  void release(int slot) override {
    const std::lock_guard lock(mutex_);
    --lent_;
    free_.push_back(slot);
    changed_.notify_all();
  }

  /// May be accessed by the thread that got `slot` from wait_free() or wait_ready().
  [[nodiscard]] StoredFrame& frame(int slot) { return frames_[static_cast<std::size_t>(slot)]; }

 private:
  std::vector<StoredFrame> frames_;
  int lendable_;
  std::mutex mutex_;
  std::condition_variable_any changed_;
  // Capacity frames_.size(), so that nothing is allocated later; ready_ is in the order of the recording.
  std::vector<int> free_, ready_;
  int lent_ = 0;
  bool ended_ = false;
};

class ReplayBackend final : public ThreadedBackend {
 public:
  ReplayBackend(Options options, double rate_asked)
      : ThreadedBackend("replay"), options_(std::move(options)), rate_asked_(rate_asked) {}
  ~ReplayBackend() override { stop(); }

  [[nodiscard]] Result<CameraInfo> open() override {
    if (source_) return Status(StatusCode::failed_precondition, "replay: is open already");
    if (Status s = replay::open_source(options_.path).assign_to(source_); !s.ok()) return s;
    CameraInfo info = source_->info();
    slots_.emplace(required_buffer_count(static_cast<int>(info.exposure_s.size())), kReadAhead);
    // A single frame has no frame rate.
    const double rate = info.frame_rate > 0 ? info.frame_rate : rate_asked_;
    timeline_.emplace(Duration::from_seconds(rate > 0 ? 1 / rate : 1));
    info.frame_rate = options_.pace == Pace::fast ? 0 : rate;
    return info;
  }

 private:
  [[nodiscard]] bool is_open() const override { return source_ != nullptr; }

  [[nodiscard]] Status before_run() override {
    slots_->begin();
    source_->rewind();
    reader_ = std::jthread([this](const std::stop_token& stop) { read(stop); });
    return {};
  }

  void after_run() override {
    reader_.request_stop();
    reader_.join();
  }

  void read(const std::stop_token& stop) {
    for (int pass = 0; options_.loops == 0 || pass < options_.loops; ++pass) {
      if (pass > 0) source_->rewind();
      // A pass without frames ends the replay; otherwise it would loop endlessly.
      if (read_pass(stop) == 0) break;
    }
    slots_->end();
  }

  /// Reads all frames once. Returns their number; 0 if stopped.
  [[nodiscard]] int read_pass(const std::stop_token& stop) {
    for (int frames = 0;; ++frames) {
      const int slot = slots_->wait_free(stop);
      if (slot == FrameSlots::kNone) return 0;
      if (!source_->next(slots_->frame(slot))) {
        slots_->drop(slot);
        return frames;
      }
      slots_->make_ready(slot);
    }
  }

  /// The player.
  void run(FrameSink& sink, const std::stop_token& stop) override {
    timeline_->start(now());
    while (true) {
      const FrameSlots::Ready ready = slots_->wait_ready(stop);
      if (ready.slot == FrameSlots::kNone) break;
      FrameInfo info = timeline_->place(slots_->frame(ready.slot).info);
      const bool shown =
          options_.pace == Pace::fast ? await_loan(info, sink, stop) : await_moment(ready.late, info, stop);
      if (!shown) {
        slots_->drop(ready.slot);
        continue;
      }
      Frame frame = slots_->lend(ready.slot);
      frame.info = info;
      frame.info.delivered = now();
      sink.push(std::move(frame));
    }
    if (!stop.stop_requested()) state_ = State::finished;
  }

  /// Fast pace: waits until a frame may be lent and the sink has space for it. False if stopped.
  [[nodiscard]] bool await_loan(FrameInfo& info, FrameSink& sink, const std::stop_token& stop) {
    if (!sink.wait_for_space(stop) || !slots_->wait_may_lend(stop)) return false;
    info.mid_exposure = timeline_->move_to(now() - Timeline::until_read_out(info, source_->info().height));
    return true;
  }

  /// Recorded pace: waits until a live camera would have delivered the frame. False if it is dropped, or on stop.
  [[nodiscard]] bool await_moment(bool read_late, FrameInfo& info, const std::stop_token& stop) {
    const Duration read_out = Timeline::until_read_out(info, source_->info().height);
    const Duration late = now() - (info.mid_exposure + read_out);
    if (read_late && late.ns > 0) {
      // The disk was slow: delay all following frames, too; otherwise they would come in a burst.
      timeline_->delay(late);
      info.mid_exposure = info.mid_exposure + late;
    } else if (late > timeline_->interval()) {
      return false;  // The sink was slow: drop the frame, as a live camera would.
    }
    return slots_->wait_until(info.mid_exposure + read_out, stop) && slots_->may_lend();
  }

  const Options options_;
  const double rate_asked_;
  std::unique_ptr<Source> source_;
  std::optional<FrameSlots> slots_;
  std::optional<Timeline> timeline_;
  std::jthread reader_;
};

}  // namespace

Result<std::unique_ptr<CameraBackend>> make_replay_backend(const CameraUri& uri, const CameraConfig& config) {
  const Result<UriParameters> parameters =
      read_parameters(uri, config, {.capture = {}, .own = {"loop", "pace"}, .renamed = {}});
  if (!parameters) return parameters.status();
  Options options;
  options.path = uri.path;
  for (const auto& [key, value] : parameters->own) {
    if (key == "loop") {
      const std::optional<int> loops = parse_number<int>(value);
      if (!loops || *loops < 0)
        return invalid_argument("replay: loop '" + value + "' must be a number of passes, or 0 to repeat without end");
      options.loops = *loops;
    } else if (value == "recorded" || value == "fast") {
      options.pace = value == "fast" ? Pace::fast : Pace::recorded;
    } else {
      return invalid_argument("replay: pace '" + value + "' must be recorded or fast");
    }
  }
  return std::unique_ptr<CameraBackend>(std::make_unique<ReplayBackend>(std::move(options), config.frame_rate));
}

}  // namespace lightwell
