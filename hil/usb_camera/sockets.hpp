// Unix sockets, without surprises: a file descriptor that closes itself, and a socket that listens.
#pragma once

#include <string>
#include <utility>

#include <lightwell/result.hpp>

namespace lightwell::usb_camera {

class FileDescriptor {
 public:
  FileDescriptor() = default;
  explicit FileDescriptor(int fd) : fd_(fd) {}
  FileDescriptor(FileDescriptor&& o) noexcept : fd_(std::exchange(o.fd_, -1)) {}
  FileDescriptor& operator=(FileDescriptor&& o) noexcept {
    std::swap(fd_, o.fd_);
    return *this;
  }
  ~FileDescriptor();

  [[nodiscard]] int get() const { return fd_; }
  [[nodiscard]] bool open() const { return fd_ >= 0; }
  void close();

 private:
  int fd_ = -1;
};

/// Listens at a path, where an old socket that nobody listens at is removed. Both it and what it accepts never block.
class Listener {
 public:
  /// resource_exhausted where somebody listens there already; invalid_argument for a path of more than 107 bytes.
  [[nodiscard]] static Result<Listener> at(const std::string& path);
  Listener(Listener&&) = default;
  Listener& operator=(Listener&&) = default;
  ~Listener();

  /// The next that waits, or a closed one where none does.
  [[nodiscard]] FileDescriptor accept() const;
  [[nodiscard]] int get() const { return socket_.get(); }

 private:
  Listener(FileDescriptor socket, std::string path) : socket_(std::move(socket)), path_(std::move(path)) {}
  FileDescriptor socket_;
  std::string path_;
};

/// Connects to a socket that listens at a path; blocking. unavailable where none does.
[[nodiscard]] Result<FileDescriptor> connect_to(const std::string& path);

}  // namespace lightwell::usb_camera
