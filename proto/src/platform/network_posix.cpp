// lightwell/host_names.hpp, pipe_signal.hpp and socket_wait.hpp by POSIX and Linux's eventfd.
#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <memory>
#include <netdb.h>
#include <poll.h>
#include <pthread.h>
#include <unistd.h>

#include <net/if.h>
#include <sys/eventfd.h>
#include <sys/socket.h>

#include <lightwell/deleter.hpp>
#include <lightwell/host_names.hpp>
#include <lightwell/pipe_signal.hpp>
#include <lightwell/socket_wait.hpp>

namespace lightwell {

std::vector<std::string> numeric_addresses(const std::string& host, HostForm form) {
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = form == HostForm::numeric ? AI_NUMERICHOST : AI_ADDRCONFIG;
  addrinfo* first = nullptr;
  if (::getaddrinfo(host.c_str(), nullptr, &hints, &first) != 0) return {};
  const std::unique_ptr<addrinfo, Deleter<::freeaddrinfo>> found(first);
  std::vector<std::string> out;
  for (const addrinfo* a = first; a != nullptr; a = a->ai_next) {
    std::array<char, NI_MAXHOST> numeric{};
    if (::getnameinfo(a->ai_addr, a->ai_addrlen, numeric.data(), numeric.size(), nullptr, 0, NI_NUMERICHOST) == 0)
      out.emplace_back(numeric.data());
  }
  return out;
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
  constexpr std::int64_t kMillisecond = 1'000'000, kMaxMs = 1'000'000;
  const std::int64_t ms = timeout.ns <= 0 ? 0 : std::min(timeout.ns / kMillisecond + 1, kMaxMs);
  ::poll(fds.data(), fds.size(), static_cast<int>(ms));
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
