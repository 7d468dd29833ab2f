// The host side of a bulk video stream: reassembles frames from transfers as Linux 6.1's uvcvideo does
// (uvc_video_decode_bulk), and checks the payload headers of UVC 1.1. Shares no code with the camera.
#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include <gtest/gtest.h>

#include "usb_camera/stream.hpp"

namespace lightwell::usb_camera::bench {

struct ReceivedFrame {
  std::vector<std::uint8_t> bytes;
  bool frame_id = false, error = false;
  std::uint32_t presentation = 0;
  int payloads = 0;
};

class VideoHost final : public TransferSink {
 public:
  /// `payload_bytes`: negotiated size of a payload, `transfer_bytes`: requested size of each transfer.
  VideoHost(std::uint32_t payload_bytes, std::size_t transfer_bytes)
      : payload_bytes_(payload_bytes), transfer_bytes_(transfer_bytes) {}

  /// Queues transfers until `count` are queued; transfers that are completed at once are not replaced.
  void queue(Stream& stream, std::size_t count) {
    for (std::size_t i = queued.size(); i < count; ++i) {
      queued.push_back(next_id_);
      stream.submit(next_id_++, transfer_bytes_, *this);
    }
  }

  void complete(std::uint64_t id, TransferStatus status, std::span<const std::uint8_t> data) override {
    const auto found = std::find(queued.begin(), queued.end(), id);
    if (found != queued.end()) queued.erase(found);
    ids.push_back(id);
    ++statuses[static_cast<std::size_t>(status)];
    if (status == TransferStatus::success) take(data);
  }

  [[nodiscard]] int count(TransferStatus status) const { return statuses[static_cast<std::size_t>(status)]; }

  std::vector<ReceivedFrame> frames;  ///< Complete frames.
  std::deque<std::uint64_t> queued;
  std::vector<std::uint64_t> ids;  ///< In the order of completion.
  std::vector<std::uint32_t> source_clocks;
  std::vector<std::uint16_t> bus_frames;

 private:
  void take(std::span<const std::uint8_t> data) {
    if (!in_payload_ && data.empty()) return;
    if (!in_payload_) {
      ASSERT_GE(data.size(), 12U) << "the header must be complete in the first transfer";
      ASSERT_EQ(data[0], 12) << "length of a header with presentation time and source clock";
      ASSERT_EQ(data[1] & 0x8C, 0x8C) << "end of header, PTS, SCR";
      header_ = data[1];
      if (!frame_) frame_.emplace();
      if (frame_->payloads > 0) {
        EXPECT_EQ(frame_->frame_id, (header_ & 1) != 0) << "FID changes within a frame";
      }
      frame_->frame_id = (header_ & 1) != 0;
      frame_->error = frame_->error || (header_ & 0x40) != 0;
      frame_->presentation = get(data, 2, 4);
      ++frame_->payloads;
      source_clocks.push_back(get(data, 6, 4));
      bus_frames.push_back(static_cast<std::uint16_t>(get(data, 10, 2)));
      in_payload_ = true;
      size_ = 0;
    }
    const std::size_t skip = size_ == 0 ? 12 : 0;
    frame_->bytes.insert(frame_->bytes.end(), data.begin() + static_cast<std::ptrdiff_t>(skip), data.end());
    size_ += data.size();
    ASSERT_LE(size_, payload_bytes_) << "the payload exceeds the negotiated size";
    if (data.size() < transfer_bytes_ || size_ >= payload_bytes_) {
      in_payload_ = false;
      if ((header_ & 2) != 0) {
        frames.push_back(std::move(*frame_));
        frame_.reset();
      }
    }
  }

  std::uint32_t payload_bytes_;
  std::size_t transfer_bytes_;
  std::uint64_t next_id_ = 1;
  int statuses[4] = {};
  std::uint8_t header_ = 0;
  bool in_payload_ = false;
  std::size_t size_ = 0;
  std::optional<ReceivedFrame> frame_;
};

}  // namespace lightwell::usb_camera::bench
