// Unix domain sockets.
#pragma once

#include <string>
#include <utility>

#include <lightwell/file_descriptor.hpp>
#include <lightwell/result.hpp>

namespace lightwell::usb_camera {

/// Listens at a path, after removing a stale socket there. The listening and the accepted sockets are non-blocking.
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

/// Connects to the socket at a path; the connection is blocking. unavailable: no process listens there.
[[nodiscard]] Result<FileDescriptor> connect_to(const std::string& path);

}  // namespace lightwell::usb_camera
