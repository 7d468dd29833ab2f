#include "firmware/camera/simulated_lens.hpp"

#include <algorithm>
#include <utility>

namespace lightwell::libcam {

using Clock = std::chrono::steady_clock;

void SimulatedCamera::unplug() {
  device_ = 0;
  tell();
}

void SimulatedCamera::plug() {
  device_ = ++last_device_;
  tell();
}

void SimulatedCamera::watch(std::shared_ptr<Mailbox> mailbox) {
  const std::lock_guard lock(mutex_);
  mailboxes_.push_back(mailbox);
}

void SimulatedCamera::tell() {
  const std::lock_guard lock(mutex_);
  for (const auto& weak : mailboxes_)
    if (const auto mailbox = weak.lock()) mailbox->cameras_changed();
}

Truth truth_of(const View& view) {
  Truth truth;
  std::memcpy(&truth, view.data.data(), sizeof truth);
  return truth;
}

struct SimulatedLens::Memory final : PictureMemory {
  std::vector<std::vector<std::byte>> pictures;
  [[nodiscard]] std::span<const std::byte> picture(int buffer) const override {
    return pictures[static_cast<std::size_t>(buffer)];
  }
  void end_reading(int) const override {}
};

std::shared_ptr<const PictureMemory> SimulatedLens::memory() const { return memory_; }

SimulatedLens::SimulatedLens(std::shared_ptr<SimulatedCamera> camera, int lens, std::shared_ptr<Mailbox> mailbox)
    : camera_(std::move(camera)), lens_(lens), mailbox_(std::move(mailbox)) {
  camera_->watch(mailbox_);
}

Status SimulatedLens::acquire(const LibcameraOptions& options, int lendable) {
  release();
  if (camera_->device() == 0) return {StatusCode::unavailable, "camera '" + id() + "' is away"};
  SupportedControls offered;
  offered.manual_exposure = offered.manual_white_balance = true;
  offered.exposure_us = ControlRange{1, 1'000'000, std::nullopt};
  offered.gain = ControlRange{1, 16, 1.0};
  offered.duration_us = ControlRange{100, 10'000'000, std::nullopt};
  Result<SelectedControls> controls = choose_controls(offered, options);
  if (!controls) return controls.status();
  controls_ = std::move(*controls);
  const SimulatedCameraOptions& o = camera_->options();
  layout_ = {PixelFormat::yuyv, o.width, o.height, packed_stride(PixelFormat::yuyv, o.width)};
  const auto total = static_cast<std::size_t>(lendable + o.depth);
  memory_ = std::make_shared<Memory>();
  memory_->pictures.assign(total, std::vector<std::byte>(picture_bytes(layout_.format, layout_.stride, o.height)));
  pictures_.assign(total, {});
  idle_.reserve(total);
  for (int i = 0; i < static_cast<int>(total); ++i) idle_.push_back(i);
  queued_.reserve(total);
  device_ = camera_->device();
  ++session_;
  return {};
}

void SimulatedLens::release() {
  stop();
  device_ = 0;
  idle_.clear();
  memory_.reset();
}

Status SimulatedLens::start() {
  if (!present()) return {StatusCode::unavailable, "camera '" + id() + "' is away"};
  stopping_ = false;
  asked_us_ = controls_.exposure_us.front();
  in_force_us_.fill(12'345);  // An arbitrary exposure left by automatic exposure.
  number_ = 0;
  thread_ = std::thread([this] { run(); });
  return {};
}

void SimulatedLens::stop() {
  if (!thread_.joinable()) return;
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  wake_.notify_all();
  thread_.join();
  idle_.insert(idle_.end(), queued_.begin(), queued_.end());
  queued_.clear();
  // Completions that have not been collected are discarded by stop().
  for (std::size_t b = 0; b < pictures_.size(); ++b) {
    if (!pictures_[b].good) continue;
    pictures_[b] = {};
    idle_.push_back(static_cast<int>(b));
  }
}

bool SimulatedLens::full() const {
  const std::lock_guard lock(mutex_);
  return idle_.empty() || queued_.size() == static_cast<std::size_t>(camera_->options().depth);
}

bool SimulatedLens::queue(std::int32_t exposure_us) {
  const std::lock_guard lock(mutex_);
  if (!present()) return false;
  queued_.push_back(idle_.front());
  idle_.erase(idle_.begin());
  asked_us_ = exposure_us;
  return true;
}

Picture SimulatedLens::collect(int buffer) {
  const std::lock_guard lock(mutex_);
  return std::exchange(pictures_[static_cast<std::size_t>(buffer)], {});
}

void SimulatedLens::make_idle(int buffer) {
  const std::lock_guard lock(mutex_);
  idle_.push_back(buffer);
}

void SimulatedLens::run() {
  const auto interval = camera_->options().interval;
  const auto since = Clock::now().time_since_epoch() - camera_->options().phase;
  auto tick = static_cast<std::uint64_t>(since / interval);
  while (true) {
    ++tick;
    const Clock::time_point end{interval * tick + camera_->options().phase};
    std::unique_lock lock(mutex_);
    if (wake_.wait_until(lock, end, [this] { return stopping_; })) return;
    if (present() && camera_->options().gives_frames) expose(tick, end);
  }
}

void SimulatedLens::expose(std::uint64_t tick, Clock::time_point end) {
  const SimulatedCameraOptions& o = camera_->options();
  // The exposure that ends now was requested `delay` frames ago.
  const auto now_us = in_force_us_[(tick - static_cast<std::uint64_t>(o.delay)) % in_force_us_.size()];
  in_force_us_[tick % in_force_us_.size()] = asked_us_;
  const std::uint64_t number = number_++;
  if (o.lost_every > 0 && number % static_cast<std::uint64_t>(o.lost_every) == 0) return;
  if (queued_.empty()) return;
  const int buffer = queued_.front();
  queued_.erase(queued_.begin());
  const auto exposed_us = static_cast<std::int32_t>(now_us * o.exposure_factor);
  Truth truth{kTruthMagic, 0, end.time_since_epoch().count(), number, exposed_us, device_};
  truth.begin_ns = truth.end_ns - std::int64_t{1000} * exposed_us;
  std::vector<std::byte>& pixels = memory_->pictures[static_cast<std::size_t>(buffer)];
  std::fill(pixels.begin(), pixels.end(), static_cast<std::byte>(number));
  std::memcpy(pixels.data(), &truth, sizeof truth);
  Picture& picture = pictures_[static_cast<std::size_t>(buffer)];
  picture.good = true;
  picture.timestamp_ns = truth.end_ns;
  picture.sequence = number;
  if (o.reports_exposure) {
    picture.exposure_s = 1e-6 * exposed_us;
    picture.gain = 1;
  }
  mailbox_->complete({lens_, session_, buffer, read_clocks()});
}

}  // namespace lightwell::libcam
