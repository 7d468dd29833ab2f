// Probe and commit: how host and camera agree on a format (UVC 1.1, 4.3.1.1).
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "usb_camera/controls.hpp"
#include "usb_camera/supported_formats.hpp"

namespace lightwell::usb_camera {

/// What was agreed on.
struct NegotiatedFormat {
  StreamFormat format;
  std::uint32_t frame_bytes = 0;    ///< dwMaxVideoFrameSize: none is larger.
  std::uint32_t payload_bytes = 0;  ///< dwMaxPayloadTransferSize: header included.
};

class Negotiation {
 public:
  /// `payload_bytes`: of a payload with its header; 0: one payload a frame, which costs a host least.
  explicit Negotiation(SupportedFormats offer, std::uint32_t payload_bytes = 0);

  /// As at power-on.
  void reset();

  /// Of the streaming interface. A probe that asks for something else than is offered is answered with the nearest
  /// that is; a commit of it stalls.
  [[nodiscard]] ControlReply request(std::uint8_t selector, ControlRequest request, std::span<const std::uint8_t> data);

  /// Set by the latest commit; the caller takes it.
  [[nodiscard]] std::optional<NegotiatedFormat> take_commit();

  [[nodiscard]] const SupportedFormats& offer() const { return offer_; }

 private:
  struct Choice {
    std::uint8_t format = 1, frame = 1;  ///< Numbers of the descriptors.
    int rate = 30;
  };
  [[nodiscard]] Choice nearest(std::span<const std::uint8_t> data) const;
  [[nodiscard]] bool exactly(const Choice& choice, std::span<const std::uint8_t> data) const;
  [[nodiscard]] NegotiatedFormat negotiated_format(const Choice& choice) const;
  [[nodiscard]] Bytes written(const Choice& choice) const;

  SupportedFormats offer_;
  std::uint32_t payload_bytes_;
  Choice initial_, probe_, committed_;
  std::optional<NegotiatedFormat> commit_;
};

}  // namespace lightwell::usb_camera
