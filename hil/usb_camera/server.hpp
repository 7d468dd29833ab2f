// The running camera: one thread that waits for QEMU, for commands, for pictures and for the time, and does what comes.
#pragma once

#include <atomic>
#include <functional>
#include <list>
#include <memory>
#include <optional>
#include <string>

#include "usb_camera/commands.hpp"
#include "usb_camera/redir_port.hpp"
#include "usb_camera/sockets.hpp"

namespace lightwell::usb_camera {

struct ServerOptions {
  std::string redir_path;    ///< Where QEMU's chardev connects.
  std::string control_path;  ///< Where commands come from; empty: from nowhere.
};

/// CLOCK_MONOTONIC.
[[nodiscard]] CameraTime camera_now();

/// At most one host at a time: another one waits until that is gone.
class Server final : public Cable, private TransferSink {
 public:
  /// `subject` says what commands act on; its cable and sink are this server. Errors of Listener::at().
  [[nodiscard]] static Result<std::unique_ptr<Server>> open(const ServerOptions& options, CommandTargets targets);
  ~Server();

  /// Until stop(). unavailable where waiting fails.
  [[nodiscard]] Status run();
  /// From any thread, or a signal handler.
  void stop();
  /// A picture is ready. From any thread.
  void wake();

  void unplug(bool close) override;
  void plug() override;
  [[nodiscard]] bool plugged() const override { return plugged_; }
  [[nodiscard]] bool host_there() const override { return port_ != nullptr; }

 private:
  struct Client {
    FileDescriptor socket;
    std::string in, out;
  };

  explicit Server(CommandTargets targets) : targets_(std::move(targets)) {}
  void complete(std::uint64_t id, TransferStatus status, std::span<const std::uint8_t> data) override;
  [[nodiscard]] Status wait();
  void serve_port();
  void close_port();
  void serve_clients();
  /// False where the client has gone or is not worth keeping.
  [[nodiscard]] bool serve(Client& client);

  CommandTargets targets_;
  std::optional<Listener> redir_, control_;
  FileDescriptor event_;
  std::unique_ptr<RedirPort> port_;
  std::list<Client> clients_;
  bool plugged_ = true;
  std::atomic<bool> stopping_{false};
};

}  // namespace lightwell::usb_camera
