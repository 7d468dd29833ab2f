#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include "camera/backend.hpp"
#include "camera/backends/libcamera/frame_pairs.hpp"
#include "camera/backends/libcamera/lens.hpp"
#include "camera/bracket_cycle.hpp"

namespace lightwell::libcam {
namespace {

/// Pause after a failure, in which a disconnection can be reported; an immediate retry would fail repeatedly.
constexpr auto kRetryDelay = std::chrono::milliseconds(200);
/// Time in which the kernel returns the remaining buffers of an unplugged camera.
constexpr auto kDrainDelay = std::chrono::milliseconds(100);
/// Interval of reconnection attempts, in addition to the notifications of libcamera.
constexpr auto kReconnectPeriod = std::chrono::milliseconds(250);
/// A connected camera without frames for this long is restarted.
constexpr auto kFrameTimeout = std::chrono::seconds(3);
/// Frames until a new exposure is reported: the requests queued before it, and the sensor's delay.
constexpr int kFramesToReport = 7;

ProbeTime now() { return {monotonic_now_ns()}; }

bool alike(double a, double b) { return std::abs(a - b) <= kExposureTolerance * std::max(a, b); }

/// Assigns frames to the exposure cycle, pairs them, computes their times, and lends them.
class LensBackend final : public ThreadedBackend, public FrameOwner {
 public:
  LensBackend(LibcameraOptions options, std::vector<std::unique_ptr<Lens>> lenses, std::shared_ptr<Mailbox> mailbox)
      : ThreadedBackend("libcamera"),
        options_(std::move(options)),
        mailbox_(std::move(mailbox)),
        lenses_(std::move(lenses)) {}
  ~LensBackend() override { stop(); }

  [[nodiscard]] Result<CameraInfo> open() override {
    if (open_) return Status(StatusCode::failed_precondition, "libcamera: the camera is open already");
    Status s = acquire_all();
    if (s.ok()) s = probe_lenses();
    if (!s.ok()) {
      for (const auto& lens : lenses_) lens->release();
      return Status(s.code(), s.message().starts_with("libcamera") ? s.message() : "libcamera: " + s.message());
    }
    open_ = true;
    return info_;
  }

  void release(int slot) override { mailbox_->give_back(slot); }

 private:
  /// A completed frame that is not delivered yet; indexed by buffer.
  struct Candidate {
    ProbeTime stamp, begin, mid, arrival;
    double exposure_s = 0, gain = 1;
    std::uint64_t sequence = 0;
    bool waits = false;  ///< Waits for its counterpart.
  };
  /// A lent frame; indexed by slot.
  struct LentFrame {
    std::array<std::shared_ptr<const PictureMemory>, kMaxLenses> memory;
    std::array<int, kMaxLenses> buffer{}, session{};
  };
  using Buffers = std::array<int, kMaxLenses>;
  using Clock = Mailbox::Clock;

  [[nodiscard]] std::size_t count() const { return lenses_.size(); }
  [[nodiscard]] std::size_t bracket() const { return info_.exposure_s.size(); }
  /// Whether each exposure is held until its frame has come (HeldCycle); otherwise every request has the next one.
  [[nodiscard]] bool holds_exposure() const {
    return bracket() > 1 && (!reports_exposure_ || (count() > 1 && !distinct_));
  }
  /// Whether two cameras run through the cycle in parallel (CycleAlignment).
  [[nodiscard]] bool aligns() const { return bracket() > 1 && count() > 1 && !holds_exposure(); }

  [[nodiscard]] bool is_open() const override { return open_; }

  [[nodiscard]] Status before_run() override {
    mailbox_->restart();
    for (const auto& lens : lenses_) {
      if (lens->present()) continue;
      if (Status s = lens->acquire(options_, static_cast<int>(lent_frames_.size())); !s.ok()) return s;
    }
    return begin();
  }

  void after_run() override {
    for (std::size_t l = 0; l < count(); ++l) {
      lenses_[l]->stop();
      for (std::size_t b = 0; b < candidates_[l].size(); ++b)
        if (candidates_[l][b].waits && lenses_[l]->acquired()) lenses_[l]->make_idle(static_cast<int>(b));
    }
    running_ = false;
  }

  [[nodiscard]] Status acquire_all() {
    const int lendable =
        required_buffer_count(static_cast<int>(std::max<std::size_t>(1, options_.capture.exposure_s.size())));
    std::size_t buffers = 0;
    for (std::size_t l = 0; l < count(); ++l) {
      if (Status s = lenses_[l]->acquire(options_, lendable); !s.ok()) return s;
      buffers += static_cast<std::size_t>(lenses_[l]->buffers());
      if (l == 0) continue;
      if (lenses_[l]->id() == lenses_[0]->id())
        return invalid_argument("camera '" + lenses_[l]->id() + "' cannot be both lenses");
      const PictureLayout &layout = lenses_[l]->layout(), &first = lenses_[0]->layout();
      if (layout.format != first.format || layout.width != first.width || layout.height != first.height)
        return {StatusCode::failed_precondition,
                "the two cameras deliver different formats or sizes: set format= and a size that both support"};
    }
    mailbox_->prepare(events_, 2 * buffers, static_cast<std::size_t>(lendable));
    lent_frames_.resize(static_cast<std::size_t>(lendable));
    free_slots_.clear();
    free_slots_.reserve(lent_frames_.size());
    for (int i = 0; i < lendable; ++i) free_slots_.push_back(i);
    return {};
  }

  [[nodiscard]] Status probe_lenses() {
    std::vector<CameraCapabilities> capabilities;
    for (const auto& lens : lenses_) {
      Result<CameraCapabilities> r = probe_capabilities(*lens, *mailbox_, events_, options_.frame_rate);
      if (!r) return r.status();
      capabilities.push_back(std::move(*r));
    }
    const CameraCapabilities& first = capabilities[0];
    reports_exposure_ = first.reports_exposure;
    gain_ = first.gain;
    interval_ = first.interval;
    const std::vector<double> asked = lenses_[0]->controls().exposure_s();
    strict_ = std::equal(asked.begin(), asked.end(), first.exposure_s.begin(), alike);
    for (const CameraCapabilities& other : capabilities) {
      if (!std::equal(first.exposure_s.begin(), first.exposure_s.end(), other.exposure_s.begin(),
                      other.exposure_s.end(), alike))
        return {StatusCode::failed_precondition,
                "the two cameras set different exposures for the same request: set exposures that both support"};
      reports_exposure_ = reports_exposure_ && other.reports_exposure;
    }
    const PictureLayout& layout = lenses_[0]->layout();
    info_ = {};
    info_.name = "libcamera:";
    for (std::size_t l = 0; l < count(); ++l) info_.name += (l == 0 ? "" : ",") + lenses_[l]->model();
    info_.width = layout.width;
    info_.height = layout.height;
    info_.format = layout.format;
    info_.lenses = static_cast<int>(count());
    info_.exposure_s = first.exposure_s;
    info_.notes = options_.notes;
    if (options_.row_readout.ns == 0)
      info_.notes.emplace_back(
          "all rows are assumed to be exposed at the same time; for a rolling shutter set row_readout=");
    for (std::size_t l = 0; l < count(); ++l)
      for (const std::vector<std::string>* notes : {&lenses_[l]->notes(), &std::as_const(capabilities[l].notes)})
        for (const std::string& note : *notes)
          info_.notes.push_back(count() > 1 ? "lens " + std::to_string(l) + ": " + note : note);
    distinct_ = distinct(info_.exposure_s);
    info_.frame_rate = 1 / interval_.seconds();
    // Frames per held exposure: the settling time, or the delay until the exposure is reported.
    if (holds_exposure()) info_.frame_rate /= reports_exposure_ ? kFramesToReport : options_.control_delay + 2;
    cycle_.emplace(info_.exposure_s);
    alignment_.emplace(static_cast<int>(bracket()), 2 * kFramesToReport);
    held_.emplace(static_cast<int>(bracket()), Duration{interval_.ns * options_.control_delay});
    pairs_.emplace(interval_);
    return {};
  }

  void run(FrameSink& sink, const std::stop_token& stop) override {
    const std::stop_callback wake(stop, [this] { mailbox_->stop(); });
    refill();
    while (true) {
      mailbox_->take(events_, Clock::now() + (running_ && Clock::now() >= pause_until_ ? kReconnectPeriod
                                                                                       : kReconnectPeriod / 10));
      if (events_.stop) return;
      const Clock::time_point woken = Clock::now();
      for (const int slot : events_.returned) take_back(slot);
      for (const Completion& c : events_.completions) quiet_since_[static_cast<std::size_t>(c.lens)] = woken;
      const auto timeout = kFrameTimeout + std::chrono::nanoseconds(30 * interval_.ns);
      for (std::size_t l = 0; running_ && l < count(); ++l)
        if (woken - quiet_since_[l] > timeout) mark_lost(l);
      if (events_.cameras_changed || !running_) reconnect_cameras();
      for (const Completion& c : events_.completions)
        if (running_) handle(c, sink);
      refill();
    }
  }

  [[nodiscard]] Status begin() {
    for (std::size_t l = 0; l < count(); ++l) {
      if (Status s = lenses_[l]->start(); !s.ok()) {
        for (const auto& lens : lenses_) lens->stop();
        return s;
      }
      candidates_[l].assign(static_cast<std::size_t>(lenses_[l]->buffers()), {});
    }
    cycle_->restart();
    held_->restart();
    pairs_->restart();
    exposure_requested_ = {};
    gone_ = {};
    failures_ = {};
    quiet_since_.fill(Clock::now());
    next_exposure_ = {};
    alignment_->restart();
    pause_until_ = {};
    running_ = true;
    state_ = State::streaming;
    return {};
  }

  void take_back(int slot) {
    LentFrame& lent_frame = lent_frames_[static_cast<std::size_t>(slot)];
    for (std::size_t l = 0; l < count(); ++l) {
      if (lenses_[l]->acquired() && lent_frame.session[l] == lenses_[l]->session())
        lenses_[l]->make_idle(lent_frame.buffer[l]);
      else
        lent_frame.memory[l]->end_reading(lent_frame.buffer[l]);
      lent_frame.memory[l].reset();
    }
    free_slots_.push_back(slot);
  }

  void reconnect_cameras() {
    for (std::size_t l = 0; l < count(); ++l)
      if (lenses_[l]->acquired() && !gone_[l] && !lenses_[l]->present()) mark_lost(l);
    if (running_ || Clock::now() < retry_at_) return;
    retry_at_ = Clock::now() + kReconnectPeriod;
    for (std::size_t l = 0; l < count(); ++l) {
      if (gone_[l]) lenses_[l]->release();
      gone_[l] = false;
    }
    // On failure the caller retries: a camera that was just connected may not be ready.
    for (const auto& lens : lenses_)
      if (!lens->acquired() && !lens->acquire(options_, static_cast<int>(lent_frames_.size())).ok()) return;
    if (!begin().ok()) gone_.fill(true);
  }

  void mark_lost(std::size_t lens) {
    state_ = State::lost;
    running_ = false;
    gone_[lens] = true;
    retry_at_ = Clock::now() + kDrainDelay;
    for (std::size_t l = 0; l < count(); ++l) {
      lenses_[l]->stop();
      for (std::size_t b = 0; b < candidates_[l].size(); ++b) {
        if (candidates_[l][b].waits) lenses_[l]->make_idle(static_cast<int>(b));
        candidates_[l][b].waits = false;
      }
    }
  }

  void refill() {
    if (!running_ || Clock::now() < pause_until_) return;
    for (std::size_t l = 0; l < count(); ++l) {
      Lens& lens = *lenses_[l];
      const std::vector<std::int32_t>& asked_us = lens.controls().exposure_us;
      while (!lens.full()) {
        const std::size_t turn = holds_exposure() ? static_cast<std::size_t>(held_->index()) : next_exposure_[l];
        if (!lens.queue(asked_us[turn])) {
          pause_until_ = Clock::now() + kRetryDelay;
          break;
        }
        if (!holds_exposure()) next_exposure_[l] = (next_exposure_[l] + 1) % bracket();
        if (!exposure_requested_[l]) held_->exposure_requested(now());
        exposure_requested_[l] = true;
      }
    }
  }

  void handle(const Completion& completion, FrameSink& sink) {
    const auto l = static_cast<std::size_t>(completion.lens);
    Lens& lens = *lenses_[l];
    if (completion.session != lens.session()) return;
    const Picture picture = lens.collect(completion.buffer);
    failures_[l] = picture.good ? 0 : failures_[l] + 1;
    if (!picture.good) {
      lens.make_idle(completion.buffer);
      if (failures_[l] > 1) pause_until_ = Clock::now() + kRetryDelay;
      return;
    }
    Candidate& c = candidates_[l][static_cast<std::size_t>(completion.buffer)];
    const std::size_t turn = holds_exposure() ? static_cast<std::size_t>(held_->index()) : 0;
    c.exposure_s = picture.exposure_s.value_or(info_.exposure_s[turn]);
    c.gain = picture.gain.value_or(gain_);
    c.sequence = picture.sequence;
    c.arrival = {completion.at.monotonic_ns};
    const FrameTiming timing{c.exposure_s, options_.row_readout, lens.layout().height, options_.timestamp_event};
    // Timestamp of an unknown clock: assume that the frame arrived when its last row had been read out.
    c.stamp = clocks_[l]
                  .to_probe_time(picture.timestamp_ns, completion.at)
                  .value_or(c.arrival - Duration{timing.row_readout.ns * timing.rows});
    c.begin = exposure_begin(c.stamp, timing);
    c.mid = mid_exposure(c.stamp, timing);
    if (count() == 1) return deliver({completion.buffer, 0}, sink);
    c.waits = true;
    pairs_->offer(completion.lens, {c.stamp, completion.buffer});
    for (FramePairer::PairResult v = pairs_->next(); v.kind != FramePairer::Kind::nothing; v = pairs_->next()) {
      if (v.kind == FramePairer::Kind::pair) {
        deliver({v.tokens[0], v.tokens[1]}, sink);
        continue;
      }
      const auto alone = static_cast<std::size_t>(v.lens);
      candidates_[alone][static_cast<std::size_t>(v.tokens[alone])].waits = false;
      lenses_[alone]->make_idle(v.tokens[alone]);
    }
  }

  void deliver(const Buffers& buffers, FrameSink& sink) {
    std::array<const Candidate*, kMaxLenses> parts{};
    for (std::size_t l = 0; l < count(); ++l) {
      Candidate& c = candidates_[l][static_cast<std::size_t>(buffers[l])];
      c.waits = false;
      parts[l] = &c;
    }
    const Candidate& first = *parts[0];
    const Candidate& last = *parts[count() - 1];
    const ProbeTime mid = first.mid + Duration{(last.mid - first.mid).ns / 2};
    // The sink was slow: drop old frames instead of delivering them in a burst.
    const bool stale = now() - std::max(first.arrival, last.arrival) > interval_ + interval_;
    if (stale || mid <= last_mid_ || (aligns() && !aligned(first, last)) || !alike(first.exposure_s, last.exposure_s) ||
        !alike(first.gain, last.gain))
      return drop(buffers);
    const std::optional<CyclePlace> at = assign_place(first, std::min(first.begin, last.begin), !free_slots_.empty());
    if (!at) return drop(buffers);

    const int slot = free_slots_.back();
    free_slots_.pop_back();
    LentFrame& lent_frame = lent_frames_[static_cast<std::size_t>(slot)];
    Frame frame(*this, slot);
    for (std::size_t l = 0; l < count(); ++l) {
      lent_frame.memory[l] = lenses_[l]->memory();
      lent_frame.buffer[l] = buffers[l];
      lent_frame.session[l] = lenses_[l]->session();
      const PictureLayout& layout = lenses_[l]->layout();
      frame.add_view({static_cast<int>(l), layout.format, layout.width, layout.height, layout.stride,
                      lent_frame.memory[l]->picture(buffers[l])});
    }
    FrameInfo& info = frame.info;
    info.sequence = at->sequence;
    info.bracket_index = at->index;
    info.bracket_size = static_cast<int>(bracket());
    info.mid_exposure = last_mid_ = mid;
    info.exposure_s = (first.exposure_s + last.exposure_s) / 2;
    info.gain = (first.gain + last.gain) / 2;
    info.row_readout = options_.row_readout;
    info.delivered = now();
    sink.push(std::move(frame));
  }

  /// Whether both frames of a pair have the same exposure; otherwise shifts the second camera's cycle.
  [[nodiscard]] bool aligned(const Candidate& first, const Candidate& second) {
    const std::optional<int> a = index_in_cycle(info_.exposure_s, first.exposure_s);
    const std::optional<int> b = index_in_cycle(info_.exposure_s, second.exposure_s);
    if (!a || !b) return false;
    const int forward = alignment_->observe(*a, *b);
    next_exposure_[1] = (next_exposure_[1] + static_cast<std::size_t>(forward)) % bracket();
    return *a == *b;
  }

  /// Index and sequence number of a frame (two cameras: of a pair), or empty if it must be dropped: its exposure is not
  /// in the cycle, is not the held one, or has not settled, or no slot is free. `first`: the part of lens 0. `begin`:
  /// when the exposure of the earlier part began. Advances the cycle.
  [[nodiscard]] std::optional<CyclePlace> assign_place(const Candidate& first, ProbeTime begin, bool has_free_slot) {
    const bool requested =
        std::all_of(exposure_requested_.begin(), exposure_requested_.begin() + static_cast<std::ptrdiff_t>(count()),
                    [](bool is_requested) { return is_requested; });
    if (!holds_exposure()) {
      // Either the camera reports the exposure, or there is only one, which must have settled.
      if (!has_free_slot || (!reports_exposure_ && !(requested && held_->settled(begin)))) return std::nullopt;
      // A single exposure that the camera could not set exactly (!strict_) always matches.
      return cycle_->place(first.sequence, strict_ ? first.exposure_s : info_.exposure_s[0]);
    }
    const double held_s = info_.exposure_s[static_cast<std::size_t>(held_->index())];
    if (!requested || !(reports_exposure_ ? alike(first.exposure_s, held_s) : held_->settled(begin)))
      return std::nullopt;
    if (!has_free_slot) {
      held_->skip();
      return std::nullopt;
    }
    exposure_requested_ = {};
    return held_->take();
  }

  void drop(const Buffers& buffers) {
    for (std::size_t l = 0; l < count(); ++l) lenses_[l]->make_idle(buffers[l]);
  }

  const LibcameraOptions options_;
  const std::shared_ptr<Mailbox> mailbox_;
  Mailbox::Events events_;
  const std::vector<std::unique_ptr<Lens>> lenses_;
  CameraInfo info_;
  bool open_ = false;

  // Measured by open()
  bool reports_exposure_ = false;
  bool distinct_ = true;  ///< All exposures of the cycle differ.
  bool strict_ = true;    ///< False: the camera could not set the single exposure exactly; any report is accepted.
  double gain_ = 1;
  Duration interval_;

  std::vector<LentFrame> lent_frames_;
  std::vector<int> free_slots_;

  // Owned by the thread while it runs
  bool running_ = false;  ///< All cameras are started.
  std::array<std::vector<Candidate>, kMaxLenses> candidates_;
  std::array<SensorClock, kMaxLenses> clocks_;
  std::optional<FramePairer> pairs_;
  std::optional<ReportedCycle> cycle_;
  std::optional<HeldCycle> held_;
  std::array<bool, kMaxLenses> exposure_requested_{}, gone_{};
  std::array<int, kMaxLenses> failures_{};
  std::array<Clock::time_point, kMaxLenses> quiet_since_{};
  std::optional<CycleAlignment> alignment_;
  std::array<std::size_t, kMaxLenses> next_exposure_{};
  Clock::time_point pause_until_, retry_at_;
  ProbeTime last_mid_;
};

}  // namespace

std::unique_ptr<CameraBackend> make_lens_backend(LibcameraOptions options, std::vector<std::unique_ptr<Lens>> lenses,
                                                 std::shared_ptr<Mailbox> mailbox) {
  return std::make_unique<LensBackend>(std::move(options), std::move(lenses), std::move(mailbox));
}

}  // namespace lightwell::libcam
