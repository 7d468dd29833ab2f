// Buffers and streaming of the simulated V4L2 device.
#include <algorithm>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <fcntl.h>
#include <unistd.h>

#include <linux/videodev2.h>
#include <sys/mman.h>

#include "firmware/camera/v4l2_device.hpp"
#include "firmware/camera/v4l2_picture.hpp"

namespace lightwell::test {
namespace {

std::int64_t clock_ns(clockid_t clock) {
  timespec t{};
  ::clock_gettime(clock, &t);
  return t.tv_sec * 1'000'000'000LL + t.tv_nsec;
}

}  // namespace

int V4l2Device::take_buffers(std::uint32_t& count) {
  if (held_) return EBUSY;
  drop_buffers();
  count = std::min<std::uint32_t>(count, static_cast<std::uint32_t>(kind_.most_buffers));
  if (slot_bytes_ * count > kMemory) return ENOMEM;
  slots_.resize(count);
  return 0;
}

int V4l2Device::set_streaming(bool on) {
  if (slots_.empty()) return EINVAL;
  if (on == streaming_) return 0;
  streaming_ = on;
  if (on) {
    sequence_ = kind_.first_sequence;
    awake_ns_ = clock_ns(CLOCK_MONOTONIC) + std::chrono::nanoseconds(kind_.wakes_up).count();
    const auto exposure = controls_.find(V4L2_CID_EXPOSURE_ABSOLUTE);
    latched_.assign(static_cast<std::size_t>(kind_.latch_frames),
                    exposure == controls_.end() ? 100 : exposure->second.value);
    wake_.notify_all();
  } else {
    queue_.clear();
    done_.clear();
    for (Slot& slot : slots_) slot.queued = slot.done = false;
  }
  tell();
  return 0;
}

int V4l2Device::on_buffer(unsigned long request, void* argument) {
  switch (request) {
    case VIDIOC_REQBUFS:
      return take_buffers(static_cast<v4l2_requestbuffers*>(argument)->count);
    case VIDIOC_STREAMON:
      return set_streaming(true);
    case VIDIOC_STREAMOFF:
      return set_streaming(false);
    case VIDIOC_EXPBUF: {
      auto& e = *static_cast<v4l2_exportbuffer*>(argument);
      if (!kind_.exports) return ENOTTY;
      if (e.index >= slots_.size()) return EINVAL;
      // Any descriptor that can be held and closed; tests do not access its memory.
      e.fd = ::memfd_create("dmabuf", MFD_CLOEXEC);
      return e.fd < 0 ? errno : 0;
    }
    case VIDIOC_QUERYBUF: {
      auto& b = *static_cast<v4l2_buffer*>(argument);
      if (b.index >= slots_.size()) return EINVAL;
      b.length = static_cast<std::uint32_t>(encoded_bytes(
          fourcc_, packed_row_bytes(fourcc_, width_) == 0 ? 0 : packed_row_bytes(fourcc_, width_) + kind_.padding,
          width_, height_));
      b.m.offset = static_cast<std::uint32_t>(b.index * slot_bytes_);
      b.flags = kind_.stamp_flags;
      return 0;
    }
    case VIDIOC_QBUF: {
      auto& b = *static_cast<v4l2_buffer*>(argument);
      if (b.index >= slots_.size() || slots_[b.index].queued || slots_[b.index].done) return EINVAL;
      slots_[b.index].queued = true;
      queue_.push_back(b.index);
      // A queued buffer belongs to the driver: overwrite it, so that a late reader is detected.
      std::memset(memory_.data() + b.index * slot_bytes_, 0xA5, slot_bytes_);
      return 0;
    }
    case VIDIOC_DQBUF: {
      auto& b = *static_cast<v4l2_buffer*>(argument);
      if (!streaming_) return EINVAL;
      if (done_.empty()) return EAGAIN;
      b.index = done_.front();
      done_.pop_front();
      Slot& slot = slots_[b.index];
      slot.done = false;
      b.bytesused = slot.bytes;
      b.flags = slot.flags;
      b.sequence = slot.sequence;
      b.timestamp = {slot.timestamp_ns / 1'000'000'000, slot.timestamp_ns % 1'000'000'000 / 1000};
      return 0;
    }
    default:
      return ENOTTY;
  }
}

void V4l2Device::expose() {
  std::unique_lock lock(mutex_);
  while (!ending_) {
    wake_.wait(lock, [this] { return ending_ || streaming_; });
    auto due = std::chrono::steady_clock::now();
    while (streaming_ && !ending_) {
      const auto interval = std::chrono::nanoseconds(1'000'000'000 / rate_);
      due += interval;
      // On a busy machine the camera becomes slower instead of catching up in a burst.
      due = std::max(due, std::chrono::steady_clock::now() - interval);
      wake_.wait_until(lock, due, [this] { return ending_ || !streaming_; });
      if (streaming_ && !ending_) take_frame(clock_ns(CLOCK_MONOTONIC));
    }
  }
}

void V4l2Device::take_frame(std::int64_t end_ns) {
  if (end_ns < awake_ns_) return;
  const auto control = controls_.find(V4L2_CID_EXPOSURE_ABSOLUTE);
  latched_.push_back(control == controls_.end() ? 100 : control->second.value);
  const int exposure = latched_.front();
  latched_.pop_front();
  const std::int64_t start_ns = end_ns - exposure * 100'000LL;
  taken_.push_back({sequence_, exposure, (start_ns + end_ns) / 2});
  if (taken_.size() > 4096) taken_.pop_front();
  const std::uint32_t sequence = sequence_++;
  if (queue_.empty() || silent_) return;

  const std::uint32_t index = queue_.front();
  queue_.pop_front();
  Slot& slot = slots_[index];
  const std::span<std::byte> memory = memory_.subspan(index * slot_bytes_, slot_bytes_);
  const std::size_t packed = packed_row_bytes(fourcc_, width_);
  const std::size_t bytes =
      draw_picture(fourcc_, width_, height_, packed + kind_.padding, kind_.scene * exposure * 1e-4, sequence, memory);
  slot.bytes = static_cast<std::uint32_t>(bytes);
  slot.flags = kind_.stamp_flags;
  if (cut_short_ > 0) {
    --cut_short_;
    if (cut_is_marked_)
      slot.flags |= V4L2_BUF_FLAG_ERROR;
    else
      slot.bytes /= 2;
  }
  slot.sequence = sequence;
  const bool monotonic = (kind_.stamp_flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) == V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
  const bool start = (kind_.stamp_flags & V4L2_BUF_FLAG_TSTAMP_SRC_MASK) == V4L2_BUF_FLAG_TSTAMP_SRC_SOE;
  slot.timestamp_ns = monotonic ? (start ? start_ns : end_ns) : clock_ns(CLOCK_REALTIME);
  slot.queued = false;
  slot.done = true;
  done_.push_back(index);
  tell();
}

}  // namespace lightwell::test
