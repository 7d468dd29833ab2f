// A simulated OAK camera behind the OakDevice interface: it boots, exposes at its own rate, applies exposures with a
// delay, reports them, queues the newest four frames, and can be unplugged. The ground truth of a frame is in its
// pixels.
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <cstring>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <lightwell/pixel.hpp>

#include "camera/backends/depthai/oak_device.hpp"

namespace lightwell::oak {

struct OakTruth {
  std::int64_t begin_ns = 0, end_ns = 0;
  std::uint32_t exposure_us = 0;
};

/// Connection state and faults of the device.
struct OakOnTheTable {
  std::atomic<bool> plugged{true};
  std::chrono::microseconds interval{10'000};
  int delay = 3;
  double exposure_factor = 1;
  std::int64_t clock_offset_ns = 0;
  bool gives_frames = true;
};

class SimulatedOak final : public OakDevice {
 public:
  explicit SimulatedOak(std::shared_ptr<OakOnTheTable> table) : table_(std::move(table)) {}

  [[nodiscard]] Result<std::string> connect(const OakOptions& options) override {
    if (!table_->plugged) return Status(StatusCode::not_found, "no device '" + options.id + "'; there are: none");
    options_ = options;
    asked_ = {{0, options.exposure_us.front()}};
    connected_ = true;
    first_ = next_ = ticks() + 1;
    return std::string("OAK 0123");
  }
  void disconnect() override { connected_ = false; }
  [[nodiscard]] bool set_exposure(std::uint32_t exposure_us, std::uint32_t) override {
    if (!here()) return false;
    asked_.emplace_back(ticks(), exposure_us);
    return true;
  }
  [[nodiscard]] WaitResult wait(OakPicture& picture, std::chrono::milliseconds timeout) override {
    if (!here()) return WaitResult::gone;
    const Clock::time_point limit = Clock::now() + timeout;
    next_ = std::max(next_, ticks() - 3);
    const Clock::time_point due{table_->interval * next_};
    std::this_thread::sleep_until(std::min(due, limit));
    if (!here()) return WaitResult::gone;
    if (due > Clock::now() || !table_->gives_frames) return WaitResult::nothing;
    expose(picture, due);
    ++next_;
    return WaitResult::picture;
  }

 private:
  using Clock = std::chrono::steady_clock;

  [[nodiscard]] bool here() const { return connected_ && table_->plugged; }
  [[nodiscard]] std::int64_t ticks() const { return Clock::now().time_since_epoch() / table_->interval; }

  void expose(OakPicture& picture, Clock::time_point due) const {
    std::uint32_t us = 0;
    for (const auto& [tick, asked] : asked_)
      if (tick + table_->delay <= next_ || tick == 0) us = asked;
    us = static_cast<std::uint32_t>(us * table_->exposure_factor);
    const bool raw = options_.format == PixelFormat::bayer_rggb10;
    picture.width = options_.width;
    picture.height = options_.height;
    picture.stride = static_cast<std::size_t>(raw ? options_.width / 4 * 5 : options_.width);
    picture.plane_stride = picture.stride * static_cast<std::size_t>(options_.height);
    const auto memory =
        std::make_shared<std::vector<std::byte>>(picture.plane_stride * 3 / 2, static_cast<std::byte>(next_));
    OakTruth truth{0, due.time_since_epoch().count(), us};
    truth.begin_ns = truth.end_ns - std::int64_t{1000} * us;
    if (!raw) std::memcpy(memory->data(), &truth, sizeof truth);
    picture.data = *memory;
    picture.holder = memory;
    picture.timestamp_ns = truth.end_ns + table_->clock_offset_ns;
    picture.sequence = next_ - first_;
    picture.exposure_us = us;
    picture.iso = options_.iso;
  }

  const std::shared_ptr<OakOnTheTable> table_;
  OakOptions options_;
  bool connected_ = false;
  std::int64_t first_ = 0, next_ = 0;
  std::vector<std::pair<std::int64_t, std::uint32_t>>
      asked_;  ///< Requested exposures, with the tick from which each applies.
};

}  // namespace lightwell::oak
