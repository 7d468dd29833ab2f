#include "usb_camera/sockets.hpp"

#include <cerrno>
#include <cstring>
#include <unistd.h>

#include <sys/socket.h>
#include <sys/un.h>

namespace lightwell::usb_camera {

namespace {

Result<sockaddr_un> address_of(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.empty() || path.size() >= sizeof address.sun_path)
    return Status(StatusCode::invalid_argument, "the socket's path '" + path + "' must have 1 to 107 bytes");
  std::memcpy(address.sun_path, path.data(), path.size());
  return address;
}

const sockaddr* generic(const sockaddr_un& address) { return reinterpret_cast<const sockaddr*>(&address); }

}  // namespace

Result<Listener> Listener::at(const std::string& path) {
  const Result<sockaddr_un> address = address_of(path);
  if (!address) return address.status();
  if (connect_to(path)) return Status(StatusCode::resource_exhausted, "another process listens at " + path);
  ::unlink(path.c_str());
  FileDescriptor socket(::socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  if (!socket || ::bind(socket.get(), generic(*address), sizeof *address) != 0 || ::listen(socket.get(), 8) != 0)
    return Status(StatusCode::unavailable, "cannot listen at " + path + ": " + std::strerror(errno));
  return Listener(std::move(socket), path);
}

Listener::~Listener() {
  if (socket_) ::unlink(path_.c_str());
}

FileDescriptor Listener::accept() const {
  return FileDescriptor(::accept4(socket_.get(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
}

Result<FileDescriptor> connect_to(const std::string& path) {
  const Result<sockaddr_un> address = address_of(path);
  if (!address) return address.status();
  FileDescriptor socket(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
  if (!socket || ::connect(socket.get(), generic(*address), sizeof *address) != 0)
    return Status(StatusCode::unavailable, "cannot connect to " + path + ": " + std::strerror(errno));
  return socket;
}

}  // namespace lightwell::usb_camera
