#include "firmware/camera/broken_camera.hpp"

#include <algorithm>
#include <chrono>

namespace lightwell {

using Clock = std::chrono::steady_clock;

BrokenCamera::~BrokenCamera() {
  stop();
  if (thread_.joinable()) {  // Still running with pushes_after_stop.
    {
      const std::lock_guard lock(mutex_);
      stopping_ = true;
      wake_.notify_all();
    }
    thread_.join();
  }
}

Result<CameraInfo> BrokenCamera::open() {
  CameraInfo info;
  info.name = "broken";
  info.width = kWidth;
  info.height = kHeight;
  info.lenses = kLenses;
  info.frame_rate = kRate;
  info.exposure_s.assign(kExposures.begin(), kExposures.end());
  const int fair = required_buffer_count(2);
  slots_.resize(static_cast<std::size_t>(is(Defect::lends_too_few)       ? fair - 1
                                         : is(Defect::lends_without_end) ? 1000
                                                                         : fair));
  for (Slot& slot : slots_)
    for (auto& picture : slot.pictures) picture.resize(3 * kWidth * kHeight);
  return info;
}

Status BrokenCamera::start(FrameSink& sink) {
  if (is(Defect::starts_once) && starts_ > 0) return {StatusCode::failed_precondition, "was started before"};
  if (thread_.joinable()) {
    if (!is(Defect::pushes_after_stop)) return {StatusCode::failed_precondition, "is streaming"};
    return {};
  }
  ++starts_;
  stopping_ = false;
  if (is(Defect::pushes_from_start)) (void)capture(sink);
  if (!is(Defect::stays_idle)) state_ = State::streaming;
  thread_ = std::thread([this, &sink] { run(sink); });
  return {};
}

void BrokenCamera::stop() {
  if (!thread_.joinable() || is(Defect::pushes_after_stop)) return;
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
    wake_.notify_all();
  }
  thread_.join();
  if (!is(Defect::is_never_idle_again)) state_ = State::idle;
  if (is(Defect::clears_memory_at_stop))
    for (Slot& slot : slots_)
      for (auto& picture : slot.pictures) std::ranges::fill(picture, std::byte{0});
}

void BrokenCamera::release(int slot) {
  if (is(Defect::forgets_releases)) return;
  const std::lock_guard lock(mutex_);
  slots_[static_cast<std::size_t>(slot)].holder = Slot::Holder::camera;
}

void BrokenCamera::run(FrameSink& sink) {
  constexpr std::chrono::milliseconds kInterval{1000 / kRate};
  Clock::time_point due = Clock::now();
  for (std::uint64_t n = 0; frames_ == 0 || n < frames_ || is(Defect::never_ends); ++n) {
    due += kInterval;
    if (!is(Defect::catches_up_in_a_burst)) {
      while (due < Clock::now()) {
        due += kInterval;
        ++sequence_;
      }
    }
    std::unique_lock lock(mutex_);
    if (wake_.wait_until(lock, due, [this] { return stopping_; })) return;
    lock.unlock();
    if (gone_ && !is(Defect::does_not_see_its_loss)) {
      state_ = State::lost;
      return;
    }
    if (is(Defect::pushes_from_two_threads) && n % 2 == 1) {
      std::thread([&] { (void)capture(sink); }).join();
    } else {
      (void)capture(sink);
    }
  }
  state_ = State::finished;
}

bool BrokenCamera::capture(FrameSink& sink) {
  const int slot = find_free();
  if (slot < 0) {
    if (!is(Defect::hides_losses)) ++sequence_;
    return false;
  }
  sink.push(frame_of(slot));
  return true;
}

int BrokenCamera::find_free() {
  const std::lock_guard lock(mutex_);
  for (std::size_t i = 0; i < slots_.size(); ++i) {
    if (slots_[i].holder == Slot::Holder::sink) continue;
    slots_[i].holder = Slot::Holder::sink;
    return static_cast<int>(i);
  }
  // The defect overwrites memory before it checks whether a buffer is free.
  if (is(Defect::writes_to_lent_memory)) slots_[0].pictures[0][0] = std::byte{0xEE};
  return -1;
}

FrameInfo BrokenCamera::next_info() {
  FrameInfo info;
  info.sequence = is(Defect::repeats_sequence) ? sequence_ / 2 : sequence_;
  info.bracket_size = 2;
  info.bracket_index = is(Defect::sticks_in_the_cycle) ? 0 : static_cast<int>(sequence_ % 2);
  info.exposure_s = kExposures[static_cast<std::size_t>(info.bracket_index)];
  if (is(Defect::leaves_the_cycle)) info.exposure_s *= 1.5;
  info.gain = is(Defect::has_no_gain) ? 0 : 1;
  info.delivered = {monotonic_now_ns()};
  info.mid_exposure = info.delivered - Duration::from_seconds(info.exposure_s / 2);
  if (is(Defect::stands_still_in_time)) info.mid_exposure.ns -= info.mid_exposure.ns % 1'000'000'000;
  if (is(Defect::stamps_the_future)) info.delivered.ns += 1'000'000'000;
  if (is(Defect::stamps_another_clock)) info.mid_exposure.ns -= 3'600'000'000'000;
  ++sequence_;
  return info;
}

Frame BrokenCamera::frame_of(int slot) {
  Slot& memory = slots_[static_cast<std::size_t>(slot)];
  Frame frame(*this, slot);
  frame.info = next_info();
  const int lenses = is(Defect::lacks_a_lens) ? 1 : kLenses;
  for (int lens = 0; lens < lenses; ++lens) {
    auto& picture = memory.pictures[static_cast<std::size_t>(lens)];
    std::ranges::fill(picture, static_cast<std::byte>(sequence_ + 1));
    View view{lens, PixelFormat::rgb8, kWidth, kHeight, 3 * kWidth, picture};
    if (is(Defect::is_smaller_than_declared)) view.height -= 2;
    if (is(Defect::has_short_data)) view.data = view.data.first(picture.size() - 1);
    frame.add_view(view);
  }
  return frame;
}

}  // namespace lightwell
