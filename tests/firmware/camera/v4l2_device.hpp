// A simulated V4L2 capture device with the behaviour of a kernel driver: formats, sizes, controls with a delay,
// buffers, and a sensor that exposes at its own rate. umock_camera.hpp puts it behind a node in /dev.
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

/// One format, with its sizes and rates.
struct DeviceFormat {
  std::uint32_t fourcc = 0;
  struct Size {
    int width = 0, height = 0;
  };
  std::vector<Size> sizes;  ///< Empty: sizes are given by the stepwise range.
  struct Steps {
    int min_width = 0, max_width = 0, step_width = 2, min_height = 0, max_height = 0, step_height = 2;
  } steps;
  std::vector<int> rates;  ///< Frames per second.
};

struct DeviceControl {
  int min = 0, max = 0, step = 1, value = 0;
  bool read_only = false;
  std::vector<int> menu;  ///< The valid entries, if the control is a menu.
};

/// Properties of the camera. Must not be changed while it is open.
struct DeviceKind {
  std::string card = "Test Camera";
  std::uint32_t capabilities = 0;  ///< 0: video capture and streaming.
  std::vector<DeviceFormat> formats;
  std::map<std::uint32_t, DeviceControl> controls;
  int latch_frames =
      1;  ///< Frames from the end of the frame at which a control is read to the frame that has its value.
  std::uint32_t stamp_flags = 0;  ///< V4L2_BUF_FLAG_TIMESTAMP_* and _TSTAMP_SRC_*.
  int most_buffers = 32;
  std::size_t padding = 0;  ///< Bytes after each row.
  bool exports = true;
  bool may_shrink = false;  ///< S_FMT returns half of the requested size.
  double scene = 40;        ///< Level of the scene: fraction of full scale per second of exposure; saturates at 1.
  std::uint32_t first_sequence = 0;
  std::chrono::milliseconds wakes_up{0};  ///< Delay of the first frame after a start.
};

/// A webcam: 64x48 of `fourcc` at 50 frames per second, controls of UVC, timestamps of the start of exposure.
[[nodiscard]] DeviceKind webcam(std::uint32_t fourcc);

/// Thread-safe. The public methods correspond to a driver's file operations.
class V4l2Device {
 public:
  explicit V4l2Device(DeviceKind kind);
  ~V4l2Device();
  V4l2Device(const V4l2Device&) = delete;
  V4l2Device& operator=(const V4l2Device&) = delete;

  /// The node was created: `file` provides the memory that buffers are mapped from.
  void plug_in(int file);
  /// From now on ioctls return ENODEV and poll() returns POLLERR; mappings stay valid.
  void pull_out();

  /// 0 or an errno.
  [[nodiscard]] int ioctl(unsigned long request, void* argument);
  /// POLLIN, POLLERR, POLLHUP as they are now.
  [[nodiscard]] short events() const;
  /// Readable when events() may have changed.
  [[nodiscard]] int event_descriptor() const { return changed_; }

  // Control by the test
  /// Simulates use by another program: ioctls that acquire the device fail with EBUSY.
  void set_busy(bool busy);
  /// Frames are still captured, but not delivered.
  void stop_delivery(bool silent);
  /// The next `frames` frames are truncated, with or without V4L2_BUF_FLAG_ERROR.
  void damage(int frames, bool marked);
  /// True exposure of frame `sequence`, in units of 100 us; 0 if it is no longer known.
  [[nodiscard]] int exposure_of(std::uint32_t sequence) const;
  /// True mid-exposure time, CLOCK_MONOTONIC; global shutter.
  [[nodiscard]] std::int64_t middle_ns_of(std::uint32_t sequence) const;
  [[nodiscard]] int control(std::uint32_t id) const;

  [[nodiscard]] bool streaming() const;

 private:
  static constexpr std::size_t kPage = 65536;  ///< At least the page size of any machine.
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
  std::deque<int> latched_;  ///< Exposures that have not taken effect yet.
  std::deque<Taken> taken_;
  std::uint32_t sequence_ = 0;
  std::int64_t awake_ns_ = 0;
  std::thread sensor_;
};

}  // namespace lightwell::test
