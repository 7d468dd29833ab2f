#include "camera/backends/v4l2/control_delay.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <poll.h>
#include <string>
#include <utility>
#include <vector>

#include "camera/backends/v4l2/exposure_schedule.hpp"
#include "camera/backends/v4l2/timing.hpp"

namespace lightwell::v4l2 {
namespace {

/// Frames until a step is taken to have had its effect, and those that are looked at after one.
constexpr int kSettle = 12, kWatched = 12;

class StepMeter {
 public:
  StepMeter(Device& device, const LevelOfBuffer& level_of) : device_(device), level_of_(level_of) {}

  /// The frames until `frames` more have come. Failure where the device stops.
  [[nodiscard]] Status watch(int frames) {
    for (int came = 0; came < frames;) {
      pollfd waiting{device_.descriptor(), POLLIN, 0};
      constexpr int kPatience_ms = 3000;
      if (::poll(&waiting, 1, kPatience_ms) == 0) return device_.error("streams no frames", ETIMEDOUT);
      v4l2_buffer buffer;
      if (const int failed = device_.dequeue(buffer); failed != 0) {
        if (failed == EAGAIN && (waiting.revents & (POLLERR | POLLHUP)) == 0) continue;
        return device_.error("stopped streaming", failed == EAGAIN ? EIO : failed);
      }
      const std::uint64_t number = sequence_.number(buffer.sequence);
      newest_ = number;
      if (const std::optional<double> level = level_of_(buffer)) levels_.push_back({number, *level});
      if (const int failed = device_.queue(static_cast<int>(buffer.index)); failed != 0)
        return device_.error("takes no buffer", failed);
      ++came;
    }
    return {};
  }

  /// Settles, sets `code`, and says how long that took to show; nothing where it does not.
  [[nodiscard]] Result<std::optional<int>> step_to(std::uint32_t control, int code) {
    if (Status s = watch(kSettle); !s.ok()) return s;
    constexpr std::size_t kBefore = 4;
    if (levels_.size() > kBefore) levels_.erase(levels_.begin(), levels_.end() - kBefore);
    const std::uint64_t set_at = newest_;
    if (const int failed = device_.set_control(control, code); failed != 0)
      return device_.error("takes no exposure", failed);
    if (Status s = watch(kWatched); !s.ok()) return s;
    const std::optional<int> delay = delay_of_step(levels_, set_at);
    levels_.clear();
    return delay;
  }

 private:
  Device& device_;
  const LevelOfBuffer& level_of_;
  SequenceCounter sequence_;
  std::uint64_t newest_ = 0;
  std::vector<Level> levels_;
};

Status not_measured(const Device& device, const std::string& why) {
  return {StatusCode::unavailable, "v4l2: (" + device.card() +
                                       ") how many frames a new exposure takes could not be "
                                       "measured: " +
                                       why + ". Give it light that is steady, or say control_delay=N"};
}

/// The same pair of exposures up and down, twice. Nothing where it does not show.
Result<std::optional<int>> measure_with(Device& device, StepMeter& meter, std::uint32_t control,
                                        std::pair<int, int> codes) {
  int least = ExposureSchedule::kMaxDelay, most = 0;
  if (const int failed = device.set_control(control, codes.first); failed != 0)
    return device.error("takes no exposure", failed);
  for (const int code : {codes.second, codes.first, codes.second, codes.first}) {
    const Result<std::optional<int>> delay = meter.step_to(control, code);
    if (!delay) return delay.status();
    if (!*delay) return std::optional<int>();
    least = std::min(least, **delay);
    most = std::max(most, **delay);
  }
  if (least != most)
    return not_measured(device, "it took " + std::to_string(least) + " to " + std::to_string(most) + " frames");
  return std::optional(least);
}

}  // namespace

Result<int> measure_control_delay(Device& device, int buffers, const ExposureControl& exposure, double rate,
                                  const LevelOfBuffer& level_of) {
  const Control& control = *exposure.control;
  // Of the bracket, then what the device can have inside a frame: one of them shows unless it is dark.
  const int whole_frame = static_cast<int>(std::lround(0.9 / (rate > 0 ? rate : 30) / kExposureUnit_s));
  const auto [shortest, longest] = std::ranges::minmax(exposure.codes);
  const std::array pairs = {
      std::pair(shortest, longest), std::pair(nearest_in(control.range, 1), nearest_in(control.range, whole_frame / 8)),
      std::pair(nearest_in(control.range, whole_frame / 8), nearest_in(control.range, whole_frame))};
  for (int i = 0; i < buffers; ++i)
    if (const int failed = device.queue(i); failed != 0) return device.error("takes no buffer", failed);
  if (const int failed = device.stream_on(); failed != 0) return device.error("does not start", failed);
  StepMeter meter(device, level_of);
  Result<int> result = not_measured(device, "no step of exposure shows in the pictures");
  for (const auto& codes : pairs) {
    if (codes.first == codes.second) continue;
    const Result<std::optional<int>> delay = measure_with(device, meter, control.id, codes);
    if (!delay) {
      result = delay.status();
      break;
    }
    if (*delay) {
      result = **delay;
      break;
    }
  }
  (void)device.stream_off();
  if (const int failed = device.set_control(control.id, exposure.codes.front()); failed != 0)
    return device.error("takes no exposure", failed);
  return result;
}

}  // namespace lightwell::v4l2
