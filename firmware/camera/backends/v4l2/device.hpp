// A V4L2 capture device as the kernel shows it: a descriptor, and calls that say what went wrong.
//   Device: open, modes, format, controls, streaming
//   MappedBuffers: the driver's memory
//   wait_for(): a frame, an error, or a descriptor that says stop
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <linux/videodev2.h>

#include <lightwell/result.hpp>

#include "camera/backends/v4l2/formats.hpp"
#include "camera/backends/v4l2/negotiation.hpp"

namespace lightwell::v4l2 {

/// A file descriptor, closed with its owner.
class FileDescriptor {
 public:
  FileDescriptor() = default;
  explicit FileDescriptor(int fd) : fd_(fd) {}
  FileDescriptor(FileDescriptor&& o) noexcept : fd_(o.fd_) { o.fd_ = -1; }
  FileDescriptor& operator=(FileDescriptor&& o) noexcept;
  ~FileDescriptor();
  [[nodiscard]] int get() const { return fd_; }

 private:
  int fd_ = -1;
};

/// What a control can be set to; whole numbers of the driver's own unit.
struct Control {
  std::uint32_t id = 0;
  std::string name;
  StepRange range;
};

/// What the driver settled on.
struct NegotiatedFormat {
  const Encoding* encoding = nullptr;
  int width = 0, height = 0;
  std::size_t bytes_per_line = 0, size_image = 0;
  double rate = 0;  ///< 0: the driver does not say.
  std::uint32_t quantization = 0, ycbcr = 0;
};

/// The driver's buffers in our memory. They stay what they are when the device is stopped, closed or unplugged; the
/// destructor gives them back.
class MappedBuffers {
 public:
  struct Buffer {
    std::span<std::byte> memory;
    FileDescriptor dmabuf;  ///< None where the driver cannot export.
  };
  MappedBuffers() = default;
  MappedBuffers(MappedBuffers&&) noexcept = default;
  MappedBuffers& operator=(MappedBuffers&& o) noexcept;
  ~MappedBuffers();

  [[nodiscard]] std::span<const Buffer> all() const { return buffers_; }
  void add(Buffer buffer) { buffers_.push_back(std::move(buffer)); }
  void clear();

 private:
  std::vector<Buffer> buffers_;
};

/// Any one thread at a time. Calls that are made for each frame return an errno, 0 where all is well.
class Device {
 public:
  /// not_found lists the devices that there are; invalid_argument for what captures no video; unavailable where it is
  /// away or in use; failed_precondition where this user may not.
  [[nodiscard]] static Result<Device> open(const std::string& path);

  [[nodiscard]] const std::string& card() const { return card_; }
  [[nodiscard]] int descriptor() const { return fd_.get(); }

  /// Of a format whose sizes come in steps, the size nearest to the one wanted.
  [[nodiscard]] std::vector<Mode> modes(const RequestedFormat& wanted) const;
  /// The driver may settle on something else; invalid_argument where that cannot be read.
  [[nodiscard]] Result<NegotiatedFormat> set_mode(const SelectedMode& choice);

  /// Nothing where the device has no such control, or it cannot be set.
  [[nodiscard]] std::optional<Control> control(std::uint32_t id) const;
  [[nodiscard]] int set_control(std::uint32_t id, int value);
  [[nodiscard]] std::optional<int> control_value(std::uint32_t id) const;

  /// As many as the driver gives, at most `count`.
  [[nodiscard]] Result<MappedBuffers> map_buffers(int count);
  /// After map_buffers(): whether the driver says that it stamps by CLOCK_MONOTONIC.
  [[nodiscard]] bool stamps_are_monotonic() const { return stamps_are_monotonic_; }
  [[nodiscard]] int queue(int index);
  /// EAGAIN where no frame waits.
  [[nodiscard]] int dequeue(v4l2_buffer& buffer);
  [[nodiscard]] int stream_on();
  [[nodiscard]] int stream_off();

  /// "v4l2: /dev/video0: ..." with what the error means and what helps.
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

/// What wait_for() waited for.
enum class PollResult : std::uint8_t {
  ready,    ///< A frame.
  broken,   ///< The device reports an error or is gone.
  nothing,  ///< Time is over.
  stopped,  ///< `stop` is readable.
};
/// Without a device, for `stop` alone.
[[nodiscard]] PollResult wait_for(const Device* device, int stop, int milliseconds);

}  // namespace lightwell::v4l2
