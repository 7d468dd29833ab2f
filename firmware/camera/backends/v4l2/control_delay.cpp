#include "camera/backends/v4l2/control_delay.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstddef>
#include <poll.h>
#include <string>
#include <utility>
#include <vector>

#include "camera/backends/v4l2/timing.hpp"

namespace lightwell::v4l2 {
namespace {

/// Frames skipped before a step, so that the previous one has taken effect, and frames observed after it.
constexpr int kSettleFrames = 12, kObservedFrames = 12;

class StepMeter {
 public:
  StepMeter(Connection& connection, Converter& converter)
      : connection_(connection), device_(connection.device), converter_(converter) {
    if (!connection.zero_copy) memory_.resize(connection.layout.picture_bytes / sizeof(std::max_align_t) + 1);
  }

  /// Records levels until `frames` more frames have come and none is waiting. An error if the device stops.
  [[nodiscard]] Status watch(int frames) {
    // If frames come faster than they can be processed, one is always waiting; hence the limit.
    for (int came = 0; came < 4 * frames;) {
      v4l2_buffer buffer;
      const int failed = device_.dequeue(buffer);
      if (failed == EAGAIN) {
        if (came >= frames) return {};
        pollfd waiting{device_.descriptor(), POLLIN, 0};
        constexpr int kTimeout_ms = 5000;
        if (::poll(&waiting, 1, kTimeout_ms) == 0) return device_.error("streams no frames", ETIMEDOUT);
        if ((waiting.revents & POLLIN) == 0 && waiting.revents != 0) return device_.error("stopped streaming", EIO);
        continue;
      }
      if (failed != 0) return device_.error("stopped streaming", failed);
      newest_ = sequence_.number(buffer.sequence);
      if (const std::optional<double> level = level_of(buffer)) levels_.push_back({newest_, *level});
      if (const int refused = device_.queue(static_cast<int>(buffer.index)); refused != 0)
        return device_.error("takes no buffer", refused);
      ++came;
    }
    return {
        StatusCode::resource_exhausted,
        "v4l2: (" + device_.card() + ") sends frames faster than they can be read here: ask for a lower rate or size"};
  }

  /// Waits until the previous exposure has settled, sets `code`, and returns the delay of the step; empty if the step
  /// is not visible, or a frame arrived while the control was set.
  [[nodiscard]] Result<std::optional<int>> step_to(std::uint32_t control, int code) {
    if (Status s = watch(kSettleFrames); !s.ok()) return s;
    constexpr std::size_t kBefore = 4;
    if (levels_.size() > kBefore) levels_.erase(levels_.begin(), levels_.end() - kBefore);
    const std::uint64_t set_at = newest_;
    if (const int failed = device_.set_control(control, code); failed != 0)
      return device_.error("takes no exposure", failed);
    pollfd next{device_.descriptor(), POLLIN, 0};
    const bool in_time = ::poll(&next, 1, 0) == 0;
    if (Status s = watch(kObservedFrames); !s.ok()) return s;
    const std::optional<int> delay = in_time ? delay_of_step(levels_, set_at) : std::nullopt;
    levels_.clear();
    return delay;
  }

 private:
  /// Mean level of the picture in a buffer, 0 to 1; empty if the picture is damaged.
  [[nodiscard]] std::optional<double> level_of(const v4l2_buffer& buffer) {
    const std::span<const std::byte> all = connection_.buffers.all()[buffer.index].memory;
    std::span<const std::byte> bytes = all.first(std::min<std::size_t>(buffer.bytesused, all.size()));
    if ((buffer.flags & V4L2_BUF_FLAG_ERROR) != 0 || bytes.size() < connection_.layout.bytes) return std::nullopt;
    if (!connection_.zero_copy) {
      const std::span<std::byte> picture = std::as_writable_bytes(std::span(memory_));
      if (!converter_.convert(bytes, picture)) return std::nullopt;
      bytes = picture;
    }
    return mean_level(view_of(*connection_.encoding, connection_.layout, bytes));
  }

  const Connection& connection_;
  Device& device_;
  Converter& converter_;
  std::vector<std::max_align_t> memory_;
  SequenceCounter sequence_;
  std::uint64_t newest_ = 0;
  std::vector<Level> levels_;
};

Status not_measured(const Device& device, const std::string& why) {
  return {StatusCode::unavailable, "v4l2: (" + device.card() +
                                       ") how many frames a new exposure takes could not be "
                                       "measured: " +
                                       why + ". Use steady light, or set control_delay=N"};
}

/// Switches between two exposures until four steps were visible; all must show the same delay. Empty after four
/// successive steps that are not visible: load of the machine or a switched lamp may disturb one.
Result<std::optional<int>> measure_with(Device& device, StepMeter& meter, std::uint32_t control,
                                        std::pair<int, int> codes) {
  constexpr int kSteps = 4, kMaxInvisible = 4;
  int min_delay = ExposureSchedule::kMaxDelay, max_delay = 0, invisible = 0;
  if (const int failed = device.set_control(control, codes.first); failed != 0)
    return device.error("takes no exposure", failed);
  for (int visible = 0, step = 0; visible < kSteps; ++step) {
    const Result<std::optional<int>> delay = meter.step_to(control, step % 2 == 0 ? codes.second : codes.first);
    if (!delay) return delay.status();
    if (!*delay) {
      if (++invisible == kMaxInvisible) return std::optional<int>();
      continue;
    }
    invisible = 0;
    ++visible;
    min_delay = std::min(min_delay, **delay);
    max_delay = std::max(max_delay, **delay);
  }
  if (min_delay != max_delay)
    return not_measured(device,
                        "it took " + std::to_string(min_delay) + " to " + std::to_string(max_delay) + " frames");
  return std::optional(min_delay);
}

/// Mean and range of the levels before or after a step.
struct Plateau {
  double mean = 0, spread = 0;
};

Plateau plateau_of(std::span<const Level> levels) {
  double sum = 0, least = levels.front().level, most = least;
  for (const Level& l : levels) {
    sum += l.level;
    least = std::min(least, l.level);
    most = std::max(most, l.level);
  }
  return {sum / static_cast<double>(levels.size()), most - least};
}

}  // namespace

double mean_level(const View& view) {
  constexpr std::size_t kGrid = 64;
  const auto width = static_cast<std::size_t>(view.width), height = static_cast<std::size_t>(view.height);
  const std::size_t columns = std::min(width, kGrid), rows = std::min(height, kGrid);
  const double full_scale = pixel_layout(view.format).full_scale();
  double sum = 0;
  for (std::size_t j = 0; j < rows; ++j) {
    for (std::size_t i = 0; i < columns; ++i) {
      // Alternate between odd and even columns, so that all colours of a mosaic are sampled.
      const std::size_t x = std::min(i * width / columns + (j + i) % 2, width - 1);
      const std::size_t y = std::min(j * height / rows + i % 2, height - 1);
      sum += code_at(view, static_cast<int>(x), static_cast<int>(y)) / full_scale;
    }
  }
  return columns * rows == 0 ? 0 : sum / static_cast<double>(columns * rows);
}

std::optional<int> delay_of_step(std::span<const Level> levels, std::uint64_t set_at) {
  constexpr std::size_t kBefore = 3, kAfter = 6, kLast = 3;
  // Smaller changes may be caused by the scene or by noise.
  constexpr double kMinStep = 0.01, kMinRelativeStep = 0.1, kTimesTheSpread = 4;
  // Largest distance of a frame from its plateau, as a fraction of the step: a frame in the middle has a mixed
  // exposure.
  constexpr double kMaxPlateauError = 0.25;

  const auto first_after =
      std::ranges::find_if(levels, [set_at](const Level& l) { return l.sequence > set_at; }) - levels.begin();
  const std::span<const Level> before = levels.first(static_cast<std::size_t>(first_after));
  const std::span<const Level> after = levels.subspan(static_cast<std::size_t>(first_after));
  if (before.size() < kBefore || after.size() < kAfter) return std::nullopt;
  for (const Level& l : levels)
    if (!std::isfinite(l.level)) return std::nullopt;

  const Plateau low = plateau_of(before), high = plateau_of(after.last(kLast));
  const double step = high.mean - low.mean, size = std::abs(step);
  if (size < kMinStep || size < kMinRelativeStep * std::max(low.mean, high.mean) ||
      size < kTimesTheSpread * std::max(low.spread, high.spread))
    return std::nullopt;

  const Level* last_old = &before.back();
  for (std::size_t i = 0; i < after.size(); ++i) {
    const double share = (after[i].level - low.mean) / step;
    if (std::abs(share) <= kMaxPlateauError) {
      last_old = &after[i];
      continue;
    }
    for (const Level& l : after.subspan(i))
      if (std::abs((l.level - low.mean) / step - 1) > kMaxPlateauError) return std::nullopt;
    if (after[i].sequence != last_old->sequence + 1) return std::nullopt;
    const std::uint64_t delay = after[i].sequence - set_at;
    return delay <= static_cast<std::uint64_t>(ExposureSchedule::kMaxDelay) ? std::optional(static_cast<int>(delay))
                                                                            : std::nullopt;
  }
  return std::nullopt;
}

Result<int> measure_control_delay(Connection& connection, Converter& converter, double rate) {
  Device& device = connection.device;
  const ExposureControl& exposure = connection.exposure;
  const Control& control = *exposure.control;
  // Try the exposures of the bracket first, then the range of the device within a frame interval: one of these steps is
  // visible unless the scene is dark.
  const int whole_frame = static_cast<int>(std::lround(0.9 / rate / kExposureUnit_s));
  const auto [shortest, longest] = std::ranges::minmax(exposure.codes);
  const std::array pairs = {
      std::pair(shortest, longest), std::pair(nearest_in(control.range, 1), nearest_in(control.range, whole_frame / 8)),
      std::pair(nearest_in(control.range, whole_frame / 8), nearest_in(control.range, whole_frame))};
  for (std::size_t i = 0; i < connection.buffers.all().size(); ++i)
    if (const int failed = device.queue(static_cast<int>(i)); failed != 0)
      return device.error("takes no buffer", failed);
  if (const int failed = device.stream_on(); failed != 0) return device.error("does not start", failed);
  StepMeter meter(connection, converter);
  Result<int> result = not_measured(device, "no step of exposure is visible in the pictures");
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
