#include "camera/backends/replay/replay_backend.hpp"

#include <atomic>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>

#include <lightwell/text.hpp>

#include "camera/backends/replay/frame_slots.hpp"
#include "camera/backends/replay/source.hpp"
#include "camera/backends/replay/timeline.hpp"
#include "camera/uri_parameters.hpp"

namespace lightwell {
namespace {

using replay::FrameSlots;
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

class ReplayBackend final : public CameraBackend {
 public:
  ReplayBackend(Options options, double rate_asked) : options_(std::move(options)), rate_asked_(rate_asked) {}
  ~ReplayBackend() override { stop(); }

  [[nodiscard]] Result<CameraInfo> open() override {
    if (source_) return Status(StatusCode::failed_precondition, "replay: is open already");
    Result<std::unique_ptr<Source>> source = replay::open_source(options_.path);
    if (!source) return source.status();
    source_ = std::move(*source);
    CameraInfo info = source_->info();
    slots_.emplace(required_buffer_count(static_cast<int>(info.exposure_s.size())), kReadAhead);
    // A single frame has no frame rate.
    const double rate = info.frame_rate > 0 ? info.frame_rate : rate_asked_;
    timeline_.emplace(Duration::from_seconds(rate > 0 ? 1 / rate : 1));
    info.frame_rate = options_.pace == Pace::fast ? 0 : rate;
    return info;
  }

  [[nodiscard]] Status start(FrameSink& sink) override {
    if (!source_) return {StatusCode::failed_precondition, "replay: open() comes before start()"};
    if (player_.joinable()) return {StatusCode::failed_precondition, "replay: stop() comes before the next start()"};
    slots_->begin();
    source_->rewind();
    state_ = State::streaming;
    reader_ = std::thread([this] { read(); });
    stop_ = std::stop_source();
    player_ = std::thread([this, &sink, stop = stop_.get_token()] { play(sink, stop); });
    return {};
  }

  void stop() override {
    if (!player_.joinable()) return;
    slots_->stop();
    stop_.request_stop();
    reader_.join();
    player_.join();
    state_ = State::idle;
  }

  [[nodiscard]] State state() const override { return state_; }

 private:
  void read() {
    for (int pass = 0; options_.loops == 0 || pass < options_.loops; ++pass) {
      if (pass > 0) source_->rewind();
      // A pass without frames ends the replay; otherwise it would loop endlessly.
      if (read_pass() == 0) break;
    }
    slots_->end();
  }

  /// Reads all frames once. Returns their number; 0 if stopped.
  [[nodiscard]] int read_pass() {
    for (int frames = 0;; ++frames) {
      const int slot = slots_->wait_free();
      if (slot == FrameSlots::kNone) return 0;
      if (!source_->next(slots_->frame(slot))) {
        slots_->drop(slot);
        return frames;
      }
      slots_->make_ready(slot);
    }
  }

  void play(FrameSink& sink, const std::stop_token& stop) {
    timeline_->start(now());
    while (true) {
      const FrameSlots::Ready ready = slots_->wait_ready();
      if (ready.slot == FrameSlots::kNone) break;
      FrameInfo info = timeline_->place(slots_->frame(ready.slot).info);
      const bool shown =
          options_.pace == Pace::fast ? await_loan(info, sink, stop) : await_moment(ready.read_timing, info);
      if (!shown) {
        slots_->drop(ready.slot);
        continue;
      }
      Frame frame = slots_->lend(ready.slot);
      frame.info = info;
      frame.info.delivered = now();
      sink.push(std::move(frame));
    }
    if (!slots_->stopped()) state_ = State::finished;
  }

  /// Fast pace: waits until a frame may be lent and the sink has space for it. False if stopped.
  [[nodiscard]] bool await_loan(FrameInfo& info, FrameSink& sink, const std::stop_token& stop) {
    if (!sink.wait_for_space(stop) || !slots_->wait_may_lend()) return false;
    info.mid_exposure = timeline_->move_to(now() - Timeline::until_read_out(info, source_->info().height));
    return true;
  }

  /// Recorded pace: waits until a live camera would have delivered the frame. False if it is dropped, or on stop.
  [[nodiscard]] bool await_moment(FrameSlots::ReadTiming read_timing, FrameInfo& info) {
    const Duration read_out = Timeline::until_read_out(info, source_->info().height);
    const Duration late = now() - (info.mid_exposure + read_out);
    if (read_timing == FrameSlots::ReadTiming::late && late.ns > 0) {
      // The disk was slow: delay all following frames, too; otherwise they would come in a burst.
      timeline_->delay(late);
      info.mid_exposure = info.mid_exposure + late;
    } else if (late > timeline_->interval()) {
      return false;  // The sink was slow: drop the frame, as a live camera would.
    }
    return slots_->wait_until(info.mid_exposure + read_out) && slots_->may_lend();
  }

  const Options options_;
  const double rate_asked_;
  std::unique_ptr<Source> source_;
  std::optional<FrameSlots> slots_;
  std::optional<Timeline> timeline_;
  std::thread reader_, player_;
  std::stop_source stop_;  ///< Ends the player's wait in FrameSink::wait_for_space().
  std::atomic<State> state_{State::idle};
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
        return Status(StatusCode::invalid_argument,
                      "replay: loop '" + value + "' must be a number of passes, or 0 to repeat without end");
      options.loops = *loops;
    } else if (value == "recorded" || value == "fast") {
      options.pace = value == "fast" ? Pace::fast : Pace::recorded;
    } else {
      return Status(StatusCode::invalid_argument, "replay: pace '" + value + "' must be recorded or fast");
    }
  }
  return std::unique_ptr<CameraBackend>(std::make_unique<ReplayBackend>(std::move(options), config.frame_rate));
}

}  // namespace lightwell
