// Splits a frame into the payloads and transfers of a bulk endpoint (UVC 1.1, 2.4.3; headers: 2.4.3.3).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <lightwell/time.hpp>

#include "usb_camera/descriptors.hpp"

namespace lightwell::usb_camera {

struct CameraClock {};
/// Nanoseconds of the camera's clock. The program uses CLOCK_MONOTONIC.
using CameraTime = TimePoint<CameraClock>;

/// The camera's clock in payload headers: microseconds modulo 2^32.
[[nodiscard]] std::uint32_t clock_ticks(CameraTime time);
/// The USB frame number in payload headers, derived from the camera's clock instead of the bus: milliseconds modulo
/// 2048.
[[nodiscard]] std::uint16_t start_of_frame(CameraTime time);

/// Size of a payload header with presentation time and source clock.
inline constexpr std::size_t kPayloadHeader = 12;

struct PayloadFields {
  bool frame_id = false;           ///< Alternates from frame to frame.
  bool error = false;              ///< The frame's ERR bit.
  std::uint32_t presentation = 0;  ///< clock_ticks() of the start of exposure.
};

/// Delivers a frame transfer by transfer. Every payload begins with a new transfer. It ends with a transfer that is
/// shorter than requested, or when it has the negotiated length. A shorter payload that fills its last transfer exactly
/// is therefore followed by an empty transfer.
class PayloadSplitter {
 public:
  /// `parts` are what is sent, one after the other; their memory must outlive this object. `payload_bytes` > 12.
  PayloadSplitter(std::vector<std::span<const std::byte>> parts, std::uint32_t payload_bytes, PayloadFields fields);

  /// Writes the bytes of a transfer of at most `length` bytes to `out`; `now` becomes the source clock if a payload
  /// begins.
  void fill(std::size_t length, CameraTime now, Bytes& out);

  [[nodiscard]] bool done() const { return left_ == 0 && !open_; }
  [[nodiscard]] bool begun() const { return begun_; }
  /// Bytes of the frame, without headers, that have been delivered.
  [[nodiscard]] std::size_t sent() const { return total_ - left_; }

 private:
  void open_payload(CameraTime now);
  void copy(std::size_t bytes, Bytes& out);

  std::vector<std::span<const std::byte>> parts_;
  std::uint32_t payload_bytes_;
  PayloadFields fields_;
  std::size_t total_ = 0, left_ = 0;
  std::size_t part_ = 0, at_ = 0;  ///< Position of the next byte.
  Bytes header_;                   ///< Remaining bytes of the header.
  std::size_t payload_left_ = 0;   ///< Remaining data bytes of the open payload.
  bool full_size_ = false;         ///< The open payload has the negotiated length.
  bool open_ = false, begun_ = false;
};

}  // namespace lightwell::usb_camera
