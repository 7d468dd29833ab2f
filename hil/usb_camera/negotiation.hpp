// Probe and commit: negotiation of the stream's format (UVC 1.1, 4.3.1.1).
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "usb_camera/controls.hpp"
#include "usb_camera/supported_formats.hpp"

namespace lightwell::usb_camera {

/// The result of a commit.
struct NegotiatedFormat {
  StreamFormat format;
  std::uint32_t frame_bytes = 0;    ///< dwMaxVideoFrameSize.
  std::uint32_t payload_bytes = 0;  ///< dwMaxPayloadTransferSize, including the header.
};

class Negotiation {
 public:
  /// `payload_bytes`: size of a payload including its header; 0: one payload per frame, which costs the host least.
  explicit Negotiation(SupportedFormats formats, std::uint32_t payload_bytes = 0);

  /// Restores the initial state.
  void reset();

  /// Answers a request to the streaming interface. A probe for an unsupported format is answered with the nearest
  /// supported one; a commit of an unsupported format is out_of_range.
  [[nodiscard]] ControlReply request(std::uint8_t selector, ControlRequest request, std::span<const std::uint8_t> data);

  /// Returns the format of the latest commit once; std::nullopt without a new commit.
  [[nodiscard]] std::optional<NegotiatedFormat> take_commit();

  [[nodiscard]] const SupportedFormats& formats() const { return formats_; }

 private:
  struct Choice {
    std::uint8_t format = 1, frame = 1;  ///< Numbers of the descriptors.
    int rate = 30;
  };
  [[nodiscard]] Choice nearest(std::span<const std::uint8_t> data) const;
  [[nodiscard]] bool exactly(const Choice& choice, std::span<const std::uint8_t> data) const;
  [[nodiscard]] NegotiatedFormat negotiated_format(const Choice& choice) const;
  [[nodiscard]] Bytes written(const Choice& choice) const;

  SupportedFormats formats_;
  std::uint32_t payload_bytes_;
  Choice initial_, probe_, committed_;
  std::optional<NegotiatedFormat> commit_;
};

}  // namespace lightwell::usb_camera
