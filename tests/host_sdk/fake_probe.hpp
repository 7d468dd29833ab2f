// A fake probe on the loopback interface that sends scripted bytes.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <grpcpp/server.h>
#include <grpcpp/support/status.h>

#include <lightwell/v1/probe_service.grpc.pb.h>

namespace lightwell::test {

/// Serves raw bytes as descriptors, so that a test can send what no encoder would.
class FakeProbe {
 public:
  FakeProbe();
  ~FakeProbe();
  FakeProbe(const FakeProbe&) = delete;
  FakeProbe& operator=(const FakeProbe&) = delete;

  /// Listens on the same port every time (any free one at first).
  void start();
  /// Closes every connection.
  void stop();
  [[nodiscard]] std::string uri() const;

  /// Messages that each stream sends at its beginning; then it stays open.
  void set_script(std::vector<std::string> messages);
  /// Offset of the probe's clock to this host's.
  void set_clock_offset_ns(std::int64_t offset_ns);

  /// The mounting in Info; none at first.
  void set_mounting(const v1::Mounting& mounting);

  enum class Firmware { present, old };
  /// An old probe has no GetConfig, and does not report the configuration after SetConfig.
  void set_firmware(Firmware firmware);

  /// How each stream of planes ends, at once. UNIMPLEMENTED at first, as of firmware that has none.
  void set_plane_end(const grpc::Status& end);

  enum class Answering { yes, no };
  /// If `no`, Info gets no response and existing streams send nothing, as from a probe that hangs.
  void set_answering(Answering answering);

  [[nodiscard]] std::optional<v1::SetConfigRequest> last_config() const;
  [[nodiscard]] std::optional<v1::ReportLuxRequest> last_lux() const;

 private:
  class Service;
  std::unique_ptr<Service> service_;
  std::unique_ptr<grpc::Server> server_;
  int port_ = 0;
};

/// Looks every few milliseconds, for half a minute at most: a bound for a hung machine, no
/// expectation.
[[nodiscard]] inline bool eventually(const std::function<bool()>& condition) {
  for (int i = 0; i < 6'000; ++i) {
    if (condition()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return false;
}

}  // namespace lightwell::test
