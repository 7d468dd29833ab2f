#include "usb_camera/payload.hpp"

#include <algorithm>
#include <utility>

namespace lightwell::usb_camera {
namespace {

constexpr std::uint8_t kFrameId = 0x01, kEndOfFrame = 0x02, kPresentation = 0x04, kSourceClock = 0x08, kError = 0x40,
                       kEndOfHeader = 0x80;

}  // namespace

std::uint32_t clock_ticks(CameraTime time) { return static_cast<std::uint32_t>(time.ns / 1000); }

std::uint16_t start_of_frame(CameraTime time) { return static_cast<std::uint16_t>(time.ns / 1'000'000 & 0x7FF); }

PayloadSplitter::PayloadSplitter(std::vector<std::span<const std::byte>> parts, std::uint32_t payload_bytes,
                                 PayloadFields fields)
    : parts_(std::move(parts)), payload_bytes_(payload_bytes), fields_(fields) {
  for (const auto& part : parts_) total_ += part.size();
  left_ = total_;
}

void PayloadSplitter::open_payload(CameraTime now) {
  payload_left_ = std::min(left_, payload_bytes_ - kPayloadHeader);
  full_size_ = payload_left_ + kPayloadHeader == payload_bytes_;
  header_.clear();
  put(header_, kPayloadHeader, 1);
  put(header_,
      static_cast<unsigned>(kEndOfHeader | kPresentation | kSourceClock | (fields_.frame_id ? kFrameId : 0) |
                            (fields_.error ? kError : 0) | (payload_left_ == left_ ? kEndOfFrame : 0)),
      1);
  put(header_, fields_.presentation, 4);
  put(header_, clock_ticks(now), 4);
  put(header_, start_of_frame(now), 2);
  open_ = begun_ = true;
}

void PayloadSplitter::copy(std::size_t bytes, Bytes& out) {
  while (bytes > 0) {
    const std::span<const std::byte> part = parts_[part_];
    const std::size_t n = std::min(bytes, part.size() - at_);
    const auto* const from = reinterpret_cast<const std::uint8_t*>(part.data()) + at_;
    out.insert(out.end(), from, from + n);
    bytes -= n;
    at_ += n;
    if (at_ == part.size()) {
      ++part_;
      at_ = 0;
    }
  }
}

void PayloadSplitter::fill(std::size_t length, CameraTime now, Bytes& out) {
  out.clear();
  if (!open_ && left_ > 0) open_payload(now);
  const std::size_t of_header = std::min(length, header_.size());
  out.insert(out.end(), header_.begin(), header_.begin() + static_cast<std::ptrdiff_t>(of_header));
  header_.erase(header_.begin(), header_.begin() + static_cast<std::ptrdiff_t>(of_header));
  const std::size_t of_data = std::min(length - of_header, payload_left_);
  copy(of_data, out);
  payload_left_ -= of_data;
  left_ -= of_data;
  if (payload_left_ == 0 && header_.empty() && (out.size() < length || full_size_)) open_ = false;
}

}  // namespace lightwell::usb_camera
