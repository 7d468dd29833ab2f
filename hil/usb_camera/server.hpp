// The camera's event loop: one thread that serves QEMU, the control socket, finished images and the frame timer.
#pragma once

#include <atomic>
#include <list>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include <lightwell/files.hpp>
#include <lightwell/result.hpp>

#include "usb_camera/commands.hpp"

struct usbredirparser;

namespace lightwell::usb_camera {

struct ServerOptions {
  std::string redir_path;    ///< Where QEMU's chardev connects.
  std::string control_path;  ///< Control socket; empty: none.
};

/// Listens at the path of a Unix domain socket, after removing a stale socket there. The listening and the accepted
/// sockets are non-blocking.
class Listener {
 public:
  /// resource_exhausted: another process listens there; invalid_argument: the path has more than 107 bytes.
  [[nodiscard]] static Result<Listener> at(const std::string& path);
  Listener(Listener&&) = default;
  Listener& operator=(Listener&&) = default;
  ~Listener();

  /// Accepts the next waiting connection; a closed descriptor if there is none.
  [[nodiscard]] FileDescriptor accept() const;
  [[nodiscard]] int get() const { return socket_.get(); }

 private:
  Listener(FileDescriptor socket, std::string path) : socket_(std::move(socket)), path_(std::move(path)) {}
  FileDescriptor socket_;
  std::string path_;
};

/// Connects to the Unix domain socket at a path; the connection is blocking. unavailable: no process listens there.
[[nodiscard]] Result<FileDescriptor> connect_to(const std::string& path);

/// USB over a socket by the usbredir protocol 0.7, which QEMU's usb-redir device implements. This side is the
/// protocol's usb-host, which has the device; QEMU is its usb-guest.
///
/// An object is one connection. No function blocks; the owner polls the socket and calls read() and write().
class RedirPort final : public TransferSink {
 public:
  /// `device` must outlive the port. `plugged`: the device is reported to the host after the host's hello packet.
  RedirPort(Device& device, FileDescriptor socket, bool plugged);
  RedirPort(const RedirPort&) = delete;
  RedirPort& operator=(const RedirPort&) = delete;
  ~RedirPort();

  /// Processes part of the received data. False: the connection is closed or the protocol is violated.
  [[nodiscard]] bool read();
  /// Sends pending data as far as the socket accepts it. False as for read().
  [[nodiscard]] bool write();
  [[nodiscard]] bool wants_write() const;
  /// False while too much data is pending, because the host requests more than it reads: its requests then have to
  /// wait.
  [[nodiscard]] bool wants_read() const;
  [[nodiscard]] int socket() const { return socket_.get(); }

  void plug();
  void unplug();

  void complete(std::uint64_t id, TransferStatus status, std::span<const std::uint8_t> data) override;

 private:
  struct Callbacks;
  struct Destroy {
    void operator()(usbredirparser* parser) const;
  };
  void announce();
  void describe();

  Device& device_;
  FileDescriptor socket_;
  std::size_t may_read_ = 0;  ///< Remaining bytes of the current read().
  bool plugged_, greeted_ = false, announced_ = false;
  std::unique_ptr<usbredirparser, Destroy> parser_;
};

/// Serves one host at a time; another one waits in the socket's queue until the first has gone.
class Server final : public Cable, private TransferSink {
 public:
  /// `targets`: the objects that commands act on; cable and sink are set to this server. Errors of Listener::at().
  [[nodiscard]] static Result<std::unique_ptr<Server>> open(const ServerOptions& options, CommandTargets targets);
  ~Server();

  /// Runs until stop(). unavailable: ppoll() fails.
  [[nodiscard]] Status run();
  /// May be called from any thread or a signal handler.
  void stop();
  /// To be called when an image is ready, from any thread.
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
  /// False: the client has disconnected, or exceeds the limits of unread input or output.
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
