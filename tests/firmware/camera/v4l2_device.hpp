// A V4L2 capture device as a kernel driver would be one, in a test's memory: formats, sizes, controls that act on later
// frames, buffers, a sensor that exposes at its own pace. umock_camera.hpp puts it behind a node in /dev.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <mutex>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include <sys/types.h>

namespace lightwell::test {

/// One format and what it comes in.
struct DeviceFormat {
  std::uint32_t fourcc = 0;
  struct Size {
    int width = 0, height = 0;
  };
  std::vector<Size> sizes;  ///< Empty, and a range of steps otherwise.
  struct Steps {
    int min_width = 0, max_width = 0, step_width = 2, min_height = 0, max_height = 0, step_height = 2;
  } steps;
  std::vector<int> rates;  ///< Frames a second.
};

struct DeviceControl {
  int min = 0, max = 0, step = 1, value = 0;
  bool read_only = false;
  std::vector<int> menu;  ///< The entries that can be chosen, where it is a menu.
};

/// What kind of camera it is. Changed only while nobody has it open.
struct DeviceKind {
  std::string card = "Test Camera";
  std::uint32_t capabilities = 0;  ///< 0: video capture and streaming.
  std::vector<DeviceFormat> formats;
  std::map<std::uint32_t, DeviceControl> controls;
  int latch_frames = 1;           ///< Between a control's value at a frame's end and the frame that has it.
  std::uint32_t stamp_flags = 0;  ///< V4L2_BUF_FLAG_TIMESTAMP_* and _TSTAMP_SRC_*.
  int most_buffers = 32;
  std::size_t padding = 0;  ///< Bytes after each row.
  bool exports = true;
  bool may_shrink = false;  ///< S_FMT gives half of the size asked for.
  double scene = 40;        ///< Share of full scale a second of exposure; the ceiling is 1.
  std::uint32_t first_sequence = 0;
  std::chrono::milliseconds wakes_up{0};  ///< Until the first frame after a start.
};

/// A webcam: 64x48 of `fourcc` at 50 frames a second, the controls of UVC, stamped at the start of exposure.
[[nodiscard]] DeviceKind webcam(std::uint32_t fourcc);

/// Thread-safe. Everything below is what a driver's ioctl handler sees.
class V4l2Device {
 public:
  explicit V4l2Device(DeviceKind kind);
  ~V4l2Device();
  V4l2Device(const V4l2Device&) = delete;
  V4l2Device& operator=(const V4l2Device&) = delete;

  /// The node was made: `file` is its memory, for buffers to be mapped from.
  void plug_in(int file);
  /// From now on ENODEV and POLLERR; what is mapped stays.
  void pull_out();

  /// 0 or an errno.
  [[nodiscard]] int ioctl(unsigned long request, void* argument);
  /// POLLIN, POLLERR, POLLHUP as they are now.
  [[nodiscard]] short events() const;
  /// Readable when events() may have changed.
  [[nodiscard]] int event_descriptor() const { return changed_; }

  // What a test asks and does.
  /// All ioctls that take the device fail with EBUSY: another program has it.
  void hold_by_another(bool held);
  /// Frames are still taken and none is given out.
  void fall_silent(bool silent);
  /// The next so many frames are given out cut short, with or without the driver's mark.
  void damage(int frames, bool marked);
  /// Frame `sequence` had this exposure, in units of 100 us; 0 where it is not known any more.
  [[nodiscard]] int exposure_of(std::uint32_t sequence) const;
  /// When its exposure's middle was in truth, CLOCK_MONOTONIC; of the first row, and no row is later.
  [[nodiscard]] std::int64_t middle_ns_of(std::uint32_t sequence) const;
  [[nodiscard]] int control(std::uint32_t id) const;

  [[nodiscard]] bool streaming() const;

 private:
  static constexpr std::size_t kPage = 65536;  ///< Of any machine.
  static constexpr std::size_t kMemory = 64 * kPage * 32;
  struct Slot {
    bool queued = false, done = false;
    std::uint32_t bytes = 0, flags = 0, sequence = 0;
    std::int64_t timestamp_ns = 0;
  };
  struct Taken {
    std::uint32_t sequence = 0;
    int exposure = 0;
    std::int64_t middle_ns = 0;
  };

  int on_query(unsigned long request, void* argument);
  int on_format(unsigned long request, void* argument);
  int on_control(unsigned long request, void* argument);
  int on_buffer(unsigned long request, void* argument);
  int take_buffers(std::uint32_t& count);
  int set_streaming(bool on);
  void drop_buffers();
  void expose();
  void take_frame(std::int64_t end_ns);
  void tell() const;
  [[nodiscard]] const DeviceFormat* format_of(std::uint32_t fourcc) const;

  const DeviceKind kind_;
  const int changed_;
  mutable std::mutex mutex_;
  std::condition_variable wake_;
  std::map<std::uint32_t, DeviceControl> controls_;
  bool plugged_ = false, streaming_ = false, held_ = false, silent_ = false, ending_ = false;
  int cut_short_ = 0;
  bool cut_is_marked_ = false;
  std::span<std::byte> memory_;
  std::vector<std::span<std::byte>> memory_of_before_;
  std::uint32_t fourcc_ = 0;
  int width_ = 0, height_ = 0, rate_ = 50;
  std::size_t slot_bytes_ = 0;
  std::vector<Slot> slots_;
  std::deque<std::uint32_t> queue_, done_;
  std::deque<int> latched_;  ///< Exposures on their way to the sensor.
  std::deque<Taken> taken_;
  std::uint32_t sequence_ = 0;
  std::int64_t awake_ns_ = 0;
  std::thread sensor_;
};

}  // namespace lightwell::test
