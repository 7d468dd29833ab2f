// Waits for a socket, interrupted by other threads.
#pragma once

#include <cstdint>
#include <string>

#include <lightwell/time.hpp>

namespace lightwell {

/// What a socket is ready for.
struct SocketEvents {
  bool readable = false;
  bool writable = false;
  bool failed = false;  ///< An error, or the other end has closed the connection.
};

/// One thread waits; any thread wakes it.
class SocketWait {
 public:
  SocketWait();
  SocketWait(const SocketWait&) = delete;
  SocketWait& operator=(const SocketWait&) = delete;
  ~SocketWait();

  /// Waits until `socket` is readable (with `wanted.writable` also until it is writable) or has failed, wake() is
  /// called, or `timeout` has passed (0 or less: does not wait). A negative number is no socket.
  [[nodiscard]] SocketEvents wait(int socket, SocketEvents wanted, Duration timeout);
  /// Makes the current or the next wait() return at once. Any thread.
  void wake() const;

 private:
  std::intptr_t wake_;  ///< POSIX: an eventfd; Windows: a datagram socket that is connected to itself.
};

/// The pending error of a socket as text, which is then cleared; empty if there is none.
[[nodiscard]] std::string take_socket_error(int socket);
/// Sets the size of a socket's send buffer (SO_SNDBUF), bytes.
void set_send_buffer(int socket, int bytes);

}  // namespace lightwell
