#include "camera/backends/v4l2/control_delay.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstddef>
#include <optional>
#include <poll.h>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "camera/backends/v4l2/exposure_schedule.hpp"
#include "camera/backends/v4l2/timing.hpp"
#include "camera/backends/v4l2/unpack.hpp"

namespace lightwell::v4l2 {
namespace {

/// Frames until a step is taken to have had its effect, and those that are looked at after one.
constexpr int kSettle = 12, kWatched = 12;

/// How bright the picture in a buffer is, 0 to 1.
class LevelMeter {
 public:
  LevelMeter(const Connection& connection, Converter& converter) : connection_(connection), converter_(converter) {
    if (!connection.lends_buffers) memory_.resize(connection.layout.picture_bytes / sizeof(std::max_align_t) + 1);
  }

  /// Nothing where it is damaged.
  [[nodiscard]] std::optional<double> level(const v4l2_buffer& buffer) {
    const std::span<const std::byte> all = connection_.buffers.all()[buffer.index].memory;
    std::span<const std::byte> bytes = all.first(std::min<std::size_t>(buffer.bytesused, all.size()));
    if ((buffer.flags & V4L2_BUF_FLAG_ERROR) != 0 || bytes.size() < connection_.layout.bytes) return std::nullopt;
    if (!connection_.lends_buffers) {
      const std::span<std::byte> picture = std::as_writable_bytes(std::span(memory_));
      if (!converter_.convert(bytes, picture)) return std::nullopt;
      bytes = picture;
    }
    return mean_level(view_of(*connection_.encoding, connection_.layout, bytes));
  }

 private:
  const Connection& connection_;
  Converter& converter_;
  std::vector<std::max_align_t> memory_;
};

class StepMeter {
 public:
  StepMeter(Device& device, LevelMeter& levels) : device_(device), meter_(levels) {}

  /// The frames until `frames` more have come and none waits. Failure where the device stops.
  [[nodiscard]] Status watch(int frames) {
    // Frames that come faster than they can be looked at never leave off waiting.
    for (int came = 0; came < 4 * frames;) {
      v4l2_buffer buffer;
      const int failed = device_.dequeue(buffer);
      if (failed == EAGAIN) {
        if (came >= frames) return {};
        pollfd waiting{device_.descriptor(), POLLIN, 0};
        constexpr int kPatience_ms = 5000;
        if (::poll(&waiting, 1, kPatience_ms) == 0) return device_.error("streams no frames", ETIMEDOUT);
        if ((waiting.revents & POLLIN) == 0 && waiting.revents != 0) return device_.error("stopped streaming", EIO);
        continue;
      }
      if (failed != 0) return device_.error("stopped streaming", failed);
      newest_ = sequence_.number(buffer.sequence);
      if (const std::optional<double> level = meter_.level(buffer)) levels_.push_back({newest_, *level});
      if (const int refused = device_.queue(static_cast<int>(buffer.index)); refused != 0)
        return device_.error("takes no buffer", refused);
      ++came;
    }
    return {
        StatusCode::resource_exhausted,
        "v4l2: (" + device_.card() + ") sends frames faster than they can be read here: ask for a lower rate or size"};
  }

  /// Settles, sets `code`, and says how long that took to show; nothing where it does not, or where it was set while
  /// another frame came.
  [[nodiscard]] Result<std::optional<int>> step_to(std::uint32_t control, int code) {
    if (Status s = watch(kSettle); !s.ok()) return s;
    constexpr std::size_t kBefore = 4;
    if (levels_.size() > kBefore) levels_.erase(levels_.begin(), levels_.end() - kBefore);
    const std::uint64_t set_at = newest_;
    if (const int failed = device_.set_control(control, code); failed != 0)
      return device_.error("takes no exposure", failed);
    pollfd next{device_.descriptor(), POLLIN, 0};
    const bool in_time = ::poll(&next, 1, 0) == 0;
    if (Status s = watch(kWatched); !s.ok()) return s;
    const std::optional<int> delay = in_time ? delay_of_step(levels_, set_at) : std::nullopt;
    levels_.clear();
    return delay;
  }

 private:
  Device& device_;
  LevelMeter& meter_;
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

/// A pair of exposures up and down, until four steps showed. Nothing where they do not, four times in a row: one may be
/// spoilt by a busy machine or by somebody who switches a lamp.
Result<std::optional<int>> measure_with(Device& device, StepMeter& meter, std::uint32_t control,
                                        std::pair<int, int> codes) {
  constexpr int kWanted = 4, kMostInVain = 4;
  int least = ExposureSchedule::kMaxDelay, most = 0, in_vain = 0;
  if (const int failed = device.set_control(control, codes.first); failed != 0)
    return device.error("takes no exposure", failed);
  for (int shown = 0, step = 0; shown < kWanted; ++step) {
    const Result<std::optional<int>> delay = meter.step_to(control, step % 2 == 0 ? codes.second : codes.first);
    if (!delay) return delay.status();
    if (!*delay) {
      if (++in_vain == kMostInVain) return std::optional<int>();
      continue;
    }
    in_vain = 0;
    ++shown;
    least = std::min(least, **delay);
    most = std::max(most, **delay);
  }
  if (least != most)
    return not_measured(device, "it took " + std::to_string(least) + " to " + std::to_string(most) + " frames");
  return std::optional(least);
}

}  // namespace

Result<int> measure_control_delay(Connection& connection, Converter& converter, double rate) {
  Device& device = connection.device;
  const ExposureControl& exposure = connection.exposure;
  const Control& control = *exposure.control;
  // Of the bracket, then what the device can have inside a frame: one of them shows unless it is dark.
  const int whole_frame = static_cast<int>(std::lround(0.9 / rate / kExposureUnit_s));
  const auto [shortest, longest] = std::ranges::minmax(exposure.codes);
  const std::array pairs = {
      std::pair(shortest, longest), std::pair(nearest_in(control.range, 1), nearest_in(control.range, whole_frame / 8)),
      std::pair(nearest_in(control.range, whole_frame / 8), nearest_in(control.range, whole_frame))};
  for (std::size_t i = 0; i < connection.buffers.all().size(); ++i)
    if (const int failed = device.queue(static_cast<int>(i)); failed != 0)
      return device.error("takes no buffer", failed);
  if (const int failed = device.stream_on(); failed != 0) return device.error("does not start", failed);
  LevelMeter levels(connection, converter);
  StepMeter meter(device, levels);
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
