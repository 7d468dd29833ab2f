// A frame cut into the payloads and transfers of a bulk endpoint (UVC 1.1, 2.4.3; headers: 2.4.3.3).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <lightwell/time.hpp>

#include "usb_camera/little_endian.hpp"

namespace lightwell::usb_camera {

struct CameraClock {};
/// Nanoseconds of the camera's own clock. The program takes CLOCK_MONOTONIC of its machine.
using CameraTime = TimePoint<CameraClock>;

/// The camera's clock as payload headers show it: microseconds, modulo 2^32.
[[nodiscard]] std::uint32_t clock_ticks(CameraTime time);
/// The number of the USB frame, as a device counts that has not seen the bus's own: milliseconds, modulo 2048.
[[nodiscard]] std::uint16_t start_of_frame(CameraTime time);

/// With presentation time and source clock.
inline constexpr std::size_t kPayloadHeader = 12;

struct PayloadFields {
  bool frame_id = false;           ///< Alternates from frame to frame.
  bool error = false;              ///< The frame's ERR bit.
  std::uint32_t presentation = 0;  ///< clock_ticks() when the exposure began.
};

/// Hands a frame out, transfer by transfer. Every payload begins a transfer. It ends with a transfer that is shorter
/// than the host asked for, or with none left where it has the agreed length: a last payload that would fill its
/// transfers without a rest gets an empty one behind.
class PayloadSplitter {
 public:
  /// `parts` are what is sent, one after the other; their memory must outlive the cutter. `payload_bytes` > 12.
  PayloadSplitter(std::vector<std::span<const std::byte>> parts, std::uint32_t payload_bytes, PayloadFields fields);

  /// The bytes of one transfer that takes so many; `now` is written as source clock where a payload begins.
  void fill(std::size_t length, CameraTime now, Bytes& out);

  [[nodiscard]] bool done() const { return left_ == 0 && !open_; }
  [[nodiscard]] bool begun() const { return begun_; }
  /// Bytes of the frame, without headers, that have gone out.
  [[nodiscard]] std::size_t sent() const { return total_ - left_; }

 private:
  void open_payload(CameraTime now);
  void copy(std::size_t bytes, Bytes& out);

  std::vector<std::span<const std::byte>> parts_;
  std::uint32_t payload_bytes_;
  PayloadFields fields_;
  std::size_t total_ = 0, left_ = 0;
  std::size_t part_ = 0, at_ = 0;  ///< Where the next byte is.
  Bytes header_;                   ///< What of it has not gone out.
  std::size_t payload_left_ = 0;   ///< Of the open payload's data.
  bool full_size_ = false;         ///< The open payload has the agreed length.
  bool open_ = false, begun_ = false;
};

}  // namespace lightwell::usb_camera
