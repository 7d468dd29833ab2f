// lightwell/host_names.hpp, pipe_signal.hpp and socket_wait.hpp by Winsock.
#include <array>

// winsock2.h comes before every other header of Windows.
// clang-format off
#include <winsock2.h>
#include <ws2tcpip.h>
#include <iphlpapi.h>
#include <netioapi.h>
// clang-format on

#include <lightwell/host_names.hpp>
#include <lightwell/pipe_signal.hpp>
#include <lightwell/socket_wait.hpp>

#include "sockets.hpp"

namespace lightwell {
namespace {

/// Starts Winsock once per process, without cleanup, because other parts of the process may use it.
void start_winsock() {
  static const int started = [] {
    WSADATA data{};
    return ::WSAStartup(MAKEWORD(2, 2), &data);
  }();
  (void)started;
}

/// A datagram socket of the loopback address that is connected to itself: what it sends, it receives.
SOCKET self_connected_socket() {
  start_winsock();
  const SOCKET out = ::socket(AF_INET, SOCK_DGRAM, IPPROTO_UDP);
  if (out == INVALID_SOCKET) return out;
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = ::htonl(INADDR_LOOPBACK);
  auto* const at = reinterpret_cast<sockaddr*>(&address);
  int size = sizeof address;
  u_long non_blocking = 1;
  if (::bind(out, at, size) == 0 && ::getsockname(out, at, &size) == 0 && ::connect(out, at, size) == 0 &&
      ::ioctlsocket(out, static_cast<long>(FIONBIO), &non_blocking) == 0)
    return out;
  ::closesocket(out);
  return INVALID_SOCKET;
}

SOCKET socket_of(std::intptr_t number) { return static_cast<SOCKET>(number); }

}  // namespace

std::vector<std::string> numeric_addresses(const std::string& host, HostForm form) {
  start_winsock();
  return platform::resolved(host, form);
}

std::string host_name() {
  start_winsock();
  std::array<char, 256> name{};
  if (::gethostname(name.data(), static_cast<int>(name.size() - 1)) != 0 || name[0] == 0) return "client";
  return name.data();
}

std::string interface_name(unsigned index) {
  std::array<char, 257> name{};  // NDIS_IF_MAX_STRING_SIZE + 1
  return ::if_indextoname(index, name.data()) == nullptr ? std::string() : name.data();
}

void block_pipe_signal() {}

void keep_pipe_signal(const std::function<void()>& function) { function(); }

SocketWait::SocketWait() : wake_(static_cast<std::intptr_t>(self_connected_socket())) {}

SocketWait::~SocketWait() {
  if (socket_of(wake_) != INVALID_SOCKET) ::closesocket(socket_of(wake_));
}

SocketEvents SocketWait::wait(int socket, SocketEvents wanted, Duration timeout) {
  const short events = static_cast<short>(POLLRDNORM | (wanted.writable ? POLLWRNORM : 0));
  std::array<WSAPOLLFD, 2> fds{{{socket_of(wake_), POLLRDNORM, 0}, {static_cast<SOCKET>(socket), events, 0}}};
  ::WSAPoll(fds.data(), socket < 0 ? 1 : 2, platform::poll_ms(timeout));
  std::array<char, 16> ignored{};
  if ((fds[0].revents & POLLRDNORM) != 0)
    while (::recv(socket_of(wake_), ignored.data(), static_cast<int>(ignored.size()), 0) > 0) {
    }
  const short got = fds[1].revents;
  return {(got & POLLRDNORM) != 0, (got & POLLWRNORM) != 0, (got & (POLLERR | POLLHUP)) != 0};
}

void SocketWait::wake() const {
  // It fails only if the socket's buffer is full, and then the other thread wakes anyway.
  (void)::send(socket_of(wake_), "w", 1, 0);
}

std::string take_socket_error(int socket) {
  int error = 0, size = sizeof error;
  if (::getsockopt(static_cast<SOCKET>(socket), SOL_SOCKET, SO_ERROR, reinterpret_cast<char*>(&error), &size) != 0 ||
      error == 0)
    return {};
  return "Winsock error " + std::to_string(error);
}

void set_send_buffer(int socket, int bytes) {
  ::setsockopt(static_cast<SOCKET>(socket), SOL_SOCKET, SO_SNDBUF, reinterpret_cast<const char*>(&bytes), sizeof bytes);
}

}  // namespace lightwell
