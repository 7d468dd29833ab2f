// Wrapper of a V4L2 capture device: file descriptor, ioctls and error messages.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <linux/videodev2.h>

#include <lightwell/files.hpp>
#include <lightwell/result.hpp>

#include "camera/backends/v4l2/formats.hpp"

namespace lightwell::v4l2 {

/// A control and its range, in the driver's own unit.
struct Control {
  std::uint32_t id = 0;
  StepRange range;
};

/// The format chosen by the driver.
struct NegotiatedFormat {
  const Encoding* encoding = nullptr;
  int width = 0, height = 0;
  std::size_t bytes_per_line = 0, size_image = 0;
  double rate = 0;  ///< Frames per second; 0: not reported.
  std::uint32_t quantization = 0, ycbcr = 0;
};

/// The driver's buffers, mapped into this process. They stay valid when the device is stopped, closed or unplugged; the
/// destructor unmaps them.
class MappedBuffers {
 public:
  struct Buffer {
    std::span<std::byte> memory;
    FileDescriptor dmabuf;  ///< Invalid if the driver cannot export.
  };
  MappedBuffers() = default;
  MappedBuffers(MappedBuffers&&) noexcept = default;
  ~MappedBuffers();

  [[nodiscard]] std::span<const Buffer> all() const { return buffers_; }
  void add(Buffer buffer) { buffers_.push_back(std::move(buffer)); }

 private:
  std::vector<Buffer> buffers_;
};

/// Where a video device is attached, by sysfs: the folder of its parent (a USB interface, a platform device) and its
/// index among the parent's nodes. A camera that is plugged into the same port again is attached at the same place, but
/// its node gets another number if the old one was still open or mapped when the camera came back.
struct Attachment {
  std::filesystem::path parent;
  std::string index;
};
/// Of the device node `path`. Empty if sysfs does not describe it, and for a virtual device, which has no parent.
[[nodiscard]] std::optional<Attachment> attachment_of(const std::string& path);
/// The device node that is attached there now, such as "/dev/video2". Empty if there is none.
[[nodiscard]] std::optional<std::string> node_at(const Attachment& attachment);

/// Not thread-safe. Methods that are called for each frame return an errno, 0 for success.
class Device {
 public:
  /// not_found lists the existing devices; invalid_argument if it is not a capture device; unavailable if it is
  /// disconnected or in use; failed_precondition if the user lacks permission.
  [[nodiscard]] static Result<Device> open(const std::string& path);

  [[nodiscard]] const std::string& card() const { return card_; }
  [[nodiscard]] int descriptor() const { return fd_.get(); }

  /// All modes; of a format with stepwise sizes only the size nearest to the wanted one.
  [[nodiscard]] std::vector<Mode> modes(const RequestedFormat& wanted) const;
  /// Sets format and rate. The driver may choose others; invalid_argument if its format is not supported.
  [[nodiscard]] Result<NegotiatedFormat> set_mode(const SelectedMode& choice);

  /// Empty if the device has no such control, or it cannot be set.
  [[nodiscard]] std::optional<Control> control(std::uint32_t id) const;
  [[nodiscard]] int set_control(std::uint32_t id, int value);
  [[nodiscard]] std::optional<int> control_value(std::uint32_t id) const;

  /// Allocates and maps as many buffers as the driver gives, at most `count`.
  [[nodiscard]] Result<MappedBuffers> map_buffers(int count);
  /// After map_buffers(): whether the driver declares CLOCK_MONOTONIC timestamps.
  [[nodiscard]] bool stamps_are_monotonic() const { return stamps_are_monotonic_; }
  [[nodiscard]] int queue(int index);
  /// EAGAIN if no frame is available.
  [[nodiscard]] int dequeue(v4l2_buffer& buffer);
  [[nodiscard]] int stream_on();
  [[nodiscard]] int stream_off();

  /// "v4l2: /dev/video0: ..." with the meaning of the error and a remedy.
  [[nodiscard]] Status error(const std::string& doing, int error) const;

 private:
  Device(std::string path, FileDescriptor fd) : path_(std::move(path)), fd_(std::move(fd)) {}
  [[nodiscard]] Status identify();
  void add_modes(std::uint32_t fourcc, const RequestedFormat& wanted, std::vector<Mode>& modes) const;
  [[nodiscard]] Mode mode_with_intervals(std::uint32_t fourcc, int width, int height) const;

  std::string path_;
  FileDescriptor fd_;
  std::string card_;
  bool stamps_are_monotonic_ = false;
};

/// Result of wait_for().
enum class PollResult : std::uint8_t {
  ready,    ///< A frame is available.
  broken,   ///< The device reports an error or is gone.
  nothing,  ///< Timeout.
  stopped,  ///< `stop` is readable.
};
/// Waits for `device` or `stop`, at most `milliseconds`. Null: waits for `stop` only.
[[nodiscard]] PollResult wait_for(const Device* device, int stop, int milliseconds);

}  // namespace lightwell::v4l2
