// The guest side of usb-redir, which is QEMU's role, for tests in this process.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "hil/usb_camera/video_host.hpp"
#include "usb_camera/device.hpp"
#include "usb_camera/server.hpp"

struct usbredirparser;

namespace lightwell::usb_camera::bench {

class RedirGuest {
 public:
  explicit RedirGuest(FileDescriptor socket);
  ~RedirGuest();

  /// Reads and writes until `condition` holds; false after ten seconds, or when the connection is closed.
  [[nodiscard]] bool until(const std::function<bool()>& condition);

  /// Sends a control request; std::nullopt if no response arrives.
  [[nodiscard]] std::optional<SetupReply> control(std::uint8_t type, std::uint8_t request, std::uint16_t value,
                                                  std::uint16_t index, std::uint16_t length, const Bytes& data = {});
  [[nodiscard]] bool set_configuration(std::uint8_t number);
  /// Probes and commits a format index, a frame index and a frame interval in units of 100 ns.
  [[nodiscard]] bool commit(std::uint8_t format, std::uint8_t frame, std::uint32_t interval);
  /// Keeps `transfers` transfers queued until `frames` further frames were received.
  [[nodiscard]] bool stream(std::size_t frames, std::size_t transfers = 5, std::size_t length = 16384);
  void submit(std::uint64_t id, std::size_t length, std::uint8_t endpoint = 0x81);
  void cancel(std::uint64_t id);
  /// Sends arbitrary bytes.
  void send_raw(const Bytes& bytes);
  /// Sends requests for endpoint types that the camera does not have.
  void send_unsupported_requests();
  void reset_bus();

  bool connected = false, gone = false;
  int connects = 0, disconnects = 0;
  std::uint16_t vendor = 0, product = 0;
  std::uint8_t speed = 0;
  int interfaces = 0;
  std::uint8_t stream_endpoint_type = 255;
  std::uint16_t stream_packet = 0;
  std::map<std::uint64_t, TransferStatus> bulk_results;
  std::uint32_t refusals = 0;  ///< Number of rejected unsupported requests.
  std::unique_ptr<VideoHost> video;

 private:
  struct Callbacks;
  struct Destroy {
    void operator()(usbredirparser* parser) const;
  };
  bool step(int timeout_ms);

  FileDescriptor socket_;
  std::unique_ptr<usbredirparser, Destroy> parser_;
  std::uint64_t next_id_ = 1;
  std::map<std::uint64_t, SetupReply> control_results_;
  std::map<std::uint64_t, bool> configuration_results_;
  std::uint32_t payload_bytes_ = 0;
};

}  // namespace lightwell::usb_camera::bench
