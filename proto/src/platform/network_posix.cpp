// lightwell/host_names.hpp, pipe_signal.hpp and socket_wait.hpp by POSIX and Linux's eventfd.
#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <netdb.h>
#include <poll.h>
#include <pthread.h>
#include <unistd.h>

#include <net/if.h>
#include <sys/eventfd.h>
#include <sys/socket.h>

#include <lightwell/host_names.hpp>
#include <lightwell/pipe_signal.hpp>
#include <lightwell/socket_wait.hpp>

#include "sockets.hpp"

namespace lightwell {

std::vector<std::string> numeric_addresses(const std::string& host, HostForm form) {
  return platform::resolved(host, form);
}

std::string host_name() {
  std::array<char, 256> name{};
  if (::gethostname(name.data(), name.size() - 1) != 0 || name[0] == 0) return "client";
  return name.data();
}

std::string interface_name(unsigned index) {
  std::array<char, IF_NAMESIZE> name{};
  return ::if_indextoname(index, name.data()) == nullptr ? std::string() : name.data();
}

void block_pipe_signal() {
  sigset_t signals;
  ::sigemptyset(&signals);
  ::sigaddset(&signals, SIGPIPE);
  ::pthread_sigmask(SIG_BLOCK, &signals, nullptr);
}

void keep_pipe_signal(const std::function<void()>& function) {
  struct sigaction before {};
  ::sigaction(SIGPIPE, nullptr, &before);
  function();
  ::sigaction(SIGPIPE, &before, nullptr);
}

SocketWait::SocketWait() : wake_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {}

SocketWait::~SocketWait() {
  if (wake_ >= 0) ::close(static_cast<int>(wake_));
}

SocketEvents SocketWait::wait(int socket, SocketEvents wanted, Duration timeout) {
  // poll() ignores negative descriptors.
  const short events = static_cast<short>(POLLIN | (wanted.writable ? POLLOUT : 0));
  std::array<pollfd, 2> fds{{{static_cast<int>(wake_), POLLIN, 0}, {socket, events, 0}}};
  ::poll(fds.data(), fds.size(), platform::poll_ms(timeout));
  eventfd_t ignored = 0;
  if ((fds[0].revents & POLLIN) != 0) (void)::eventfd_read(static_cast<int>(wake_), &ignored);
  const short got = fds[1].revents;
  return {(got & POLLIN) != 0, (got & POLLOUT) != 0, (got & (POLLERR | POLLHUP)) != 0};
}

void SocketWait::wake() const {
  // It fails only if the counter is full, and then the other thread wakes anyway.
  (void)::eventfd_write(static_cast<int>(wake_), 1);
}

std::string take_socket_error(int socket) {
  int error = 0;
  socklen_t size = sizeof error;
  if (::getsockopt(socket, SOL_SOCKET, SO_ERROR, &error, &size) != 0 || error == 0) return {};
  return std::strerror(error);
}

void set_send_buffer(int socket, int bytes) { ::setsockopt(socket, SOL_SOCKET, SO_SNDBUF, &bytes, sizeof bytes); }

}  // namespace lightwell
