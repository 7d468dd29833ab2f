#include "camera/backends/libcamera/lens.hpp"

#include <cmath>
#include <ctime>

#include <lightwell/text.hpp>

#include "camera/bracket_cycle.hpp"

namespace lightwell::libcam {
namespace {

using Clock = Mailbox::Clock;

constexpr auto kFirstFrameTimeout = std::chrono::seconds(5);
/// Maximum number of frames until an exposure takes effect; the deepest pipelines need eight.
constexpr int kMaxSettleFrames = 24;
/// Number of frames over which the frame rate is measured.
constexpr int kFramesForRate = 8;

std::string ms_text(double s) { return formatted("%.4g ms", 1e3 * s); }

bool is_close(double a, double b) { return std::abs(a - b) <= kExposureTolerance * b; }

class Run {
 public:
  Run(Lens& lens, Mailbox& mailbox, Mailbox::Events& post) : lens_(lens), mailbox_(mailbox), events_(post) {}

  /// Waits for the next complete frame; false on timeout.
  [[nodiscard]] bool next(std::int32_t exposure_us, Picture& picture) {
    const Clock::time_point limit = Clock::now() + kFirstFrameTimeout;
    while (Clock::now() < limit) {
      while (!lens_.full())
        if (!lens_.queue(exposure_us)) return false;
      if (at_ == events_.completions.size()) {
        mailbox_.take(events_, limit);
        at_ = 0;
        continue;
      }
      const Completion& completion = events_.completions[at_++];
      if (completion.session != lens_.session()) continue;
      picture = lens_.collect(completion.buffer);
      lens_.make_idle(completion.buffer);
      if (!picture.good) continue;
      if (!first_) first_ = picture;
      last_ = picture;
      ++frames_;
      return true;
    }
    return false;
  }

  [[nodiscard]] int frames() const { return frames_; }
  [[nodiscard]] Duration interval(Duration nominal) const {
    if (!first_) return nominal;
    return measured_interval({last_.timestamp_ns - first_->timestamp_ns}, last_.sequence - first_->sequence, nominal);
  }

 private:
  Lens& lens_;
  Mailbox& mailbox_;
  Mailbox::Events& events_;
  std::size_t at_ = 0;
  std::optional<Picture> first_;
  Picture last_;
  int frames_ = 0;
};

/// For cameras that report exposures: requests each one until a frame has it.
Status probe_exposures(Run& run, const SelectedControls& controls, Picture picture, CameraCapabilities& learned) {
  for (std::size_t i = 0; i < controls.exposure_us.size(); ++i) {
    const double asked = 1e-6 * controls.exposure_us[i];
    int frames = 0;
    while (!is_close(picture.exposure_s.value_or(0), asked) && frames++ < kMaxSettleFrames)
      if (!run.next(controls.exposure_us[i], picture))
        return {StatusCode::unavailable, "it stopped delivering frames while exposures were tested"};
    const double got = picture.exposure_s.value_or(0);
    if (!is_close(got, asked)) {
      if (controls.exposure_us.size() > 1 || got <= 0)
        return {StatusCode::failed_precondition,
                "an exposure of " + ms_text(asked) + " was requested, but it reports " + ms_text(got) + " after " +
                    std::to_string(kMaxSettleFrames) + " frames: request one that is possible at this frame rate"};
      learned.notes.push_back("an exposure of " + ms_text(asked) + " was requested, the camera reports " +
                              ms_text(got));
    }
    learned.exposure_s[i] = got;
    learned.gain = picture.gain.value_or(learned.gain);
  }
  return {};
}

/// Largest plausible age of a frame on arrival.
constexpr std::int64_t kMaxAge_ns = 5'000'000'000;

std::int64_t clock_ns(clockid_t id) {
  timespec t{};
  clock_gettime(id, &t);
  return static_cast<std::int64_t>(t.tv_sec) * 1'000'000'000 + t.tv_nsec;
}

}  // namespace

ClockReading read_clocks() {
  // CLOCK_MONOTONIC is read before and after CLOCK_BOOTTIME, and averaged, so that the time between the calls cancels.
  const std::int64_t before = clock_ns(CLOCK_MONOTONIC);
  const std::int64_t boottime = clock_ns(CLOCK_BOOTTIME);
  const std::int64_t after = clock_ns(CLOCK_MONOTONIC);
  return {before + (after - before) / 2, boottime};
}

std::optional<ProbeTime> SensorClock::to_probe_time(std::int64_t timestamp_ns, const ClockReading& now) {
  const auto plausible = [&](std::int64_t t) {
    return t > 0 && t <= now.monotonic_ns && t >= now.monotonic_ns - kMaxAge_ns;
  };
  if (timestamp_ns <= 0) return std::nullopt;
  const std::int64_t slept_ns = now.boottime_ns - now.monotonic_ns;
  const std::int64_t from_boottime = timestamp_ns - slept_ns;
  if (!boottime_ && plausible(timestamp_ns)) return ProbeTime{timestamp_ns};
  if (!plausible(from_boottime)) return std::nullopt;
  boottime_ = true;
  return ProbeTime{from_boottime};
}

ProbeTime exposure_begin(ProbeTime stamp, const FrameTiming& timing) {
  return timing.event == TimestampEvent::exposure ? stamp : stamp - Duration::from_seconds(timing.exposure_s);
}

ProbeTime mid_exposure(ProbeTime stamp, const FrameTiming& timing) {
  const Duration half_exposure = Duration::from_seconds(timing.exposure_s / 2);
  const Duration to_centre{timing.row_readout.ns * timing.rows / 2};
  return exposure_begin(stamp, timing) + half_exposure + to_centre;
}

Duration measured_interval(Duration passed, std::uint64_t frames, Duration nominal) {
  if (frames == 0 || frames > 100'000 || passed.ns <= 0) return nominal;
  return {passed.ns / static_cast<std::int64_t>(frames)};
}

Result<CameraCapabilities> probe_capabilities(Lens& lens, Mailbox& mailbox, Mailbox::Events& post,
                                              double nominal_rate) {
  const SelectedControls& controls = lens.controls();
  const Duration nominal = controls.duration_us ? Duration{*controls.duration_us * 1000}
                                                : Duration::from_seconds(1 / (nominal_rate > 0 ? nominal_rate : 30));
  // Discard completions left over from another lens.
  post.completions.clear();
  mailbox.restart();
  if (Status s = lens.start(); !s.ok()) return s;
  Run run(lens, mailbox, post);
  CameraCapabilities learned;
  learned.exposure_s = controls.exposure_s();
  learned.gain = controls.assumed_gain();
  Status status;
  Picture picture;
  if (!run.next(controls.exposure_us.front(), picture)) {
    status = {StatusCode::unavailable, "no whole frame came within 5 s: is its cable good, is the bus too busy?"};
  } else {
    learned.reports_exposure = picture.exposure_s.has_value();
    if (learned.reports_exposure) status = probe_exposures(run, controls, picture, learned);
    while (status.ok() && run.frames() < kFramesForRate)
      if (!run.next(controls.exposure_us.front(), picture))
        status = {StatusCode::unavailable, "it stopped delivering frames"};
  }
  learned.interval = run.interval(nominal);
  lens.stop();
  mailbox.restart();
  if (!status.ok()) return status.in("camera '" + lens.id() + "'");
  if (!learned.reports_exposure && controls.exposure_us.size() > 1)
    learned.notes.emplace_back(
        "the camera does not report exposures: each is held until it has certainly taken effect, which "
        "lowers the frame rate");
  return learned;
}

}  // namespace lightwell::libcam
