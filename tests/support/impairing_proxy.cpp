#include "support/impairing_proxy.hpp"

#include <algorithm>
#include <cstdlib>
#include <fcntl.h>
#include <iostream>
#include <poll.h>
#include <unistd.h>

#include <arpa/inet.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include "support/loopback.hpp"

namespace lightwell::test {
namespace {

/// Size of the buffer per direction, as in a router. While it is full, nothing is read from the sender.
constexpr std::size_t kMaxInFlightBytes = 4 << 20;

[[noreturn]] void broken(const char* what) {
  std::cerr << "ImpairingProxy: " << what << " failed\n";
  std::abort();
}

void set_up(int socket) {
  const int on = 1;
  ::setsockopt(socket, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  ::fcntl(socket, F_SETFL, ::fcntl(socket, F_GETFL) | O_NONBLOCK);
  ::fcntl(socket, F_SETFD, FD_CLOEXEC);
}

/// Closes a socket with a TCP reset (SO_LINGER 0).
void reset(int socket) {
  const linger now{1, 0};
  ::setsockopt(socket, SOL_SOCKET, SO_LINGER, &now, sizeof now);
  ::close(socket);
}

}  // namespace

ImpairingProxy::ImpairingProxy(int server_port, std::uint32_t seed) : server_port_(server_port), random_(seed) {
  if (::pipe2(wake_, O_CLOEXEC | O_NONBLOCK) != 0) broken("pipe");
  listen_again();
  thread_ = std::thread([this] { run(); });
}

ImpairingProxy::~ImpairingProxy() {
  stopping_ = true;
  (void)!::write(wake_[1], "", 1);
  thread_.join();
  close_all();
  if (listener_ >= 0) ::close(listener_);
  ::close(wake_[0]);
  ::close(wake_[1]);
}

void ImpairingProxy::listen_again() {
  listener_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  const int on = 1;
  ::setsockopt(listener_, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  sockaddr_in address = loopback(port_);
  socklen_t size = sizeof address;
  if (::bind(listener_, reinterpret_cast<sockaddr*>(&address), size) != 0) broken("bind");
  if (::listen(listener_, 256) != 0) broken("listen");
  if (::getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size) != 0) broken("getsockname");
  port_ = ntohs(address.sin_port);
}

void ImpairingProxy::impair(const Impairment& impairment) {
  const std::lock_guard lock(mutex_);
  impairment_ = impairment;
}
void ImpairingProxy::hold() { held_ = true; }
void ImpairingProxy::resume() {
  held_ = false;
  (void)!::write(wake_[1], "", 1);
}
void ImpairingProxy::cut() {
  cut_ = true;
  (void)!::write(wake_[1], "", 1);
}
void ImpairingProxy::restore() {
  cut_ = false;
  (void)!::write(wake_[1], "", 1);
}

std::vector<std::byte> ImpairingProxy::carried(Direction direction) const {
  const std::lock_guard lock(mutex_);
  std::vector<std::byte> out;
  for (const auto& connection : carried_) {
    const std::vector<std::byte>& flow = connection[static_cast<std::size_t>(direction)];
    out.insert(out.end(), flow.begin(), flow.end());
  }
  return out;
}

void ImpairingProxy::close_all() {
  for (Pair& pair : pairs_) {
    reset(pair.flows[0].from);
    reset(pair.flows[1].from);
  }
  pairs_.clear();
}

void ImpairingProxy::accept_one() {
  const int client = ::accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
  if (client < 0) return;
  const int server = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const sockaddr_in address = loopback(server_port_);
  if (::connect(server, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    reset(client);
    ::close(server);
    return;
  }
  set_up(client);
  set_up(server);
  Pair& pair = pairs_.emplace_back();
  {
    const std::lock_guard lock(mutex_);
    pair.number = carried_.size();
    carried_.emplace_back();
  }
  pair.flows[0].from = pair.flows[1].to = client;
  pair.flows[0].to = pair.flows[1].from = server;
}

void ImpairingProxy::read_some(Pair& pair, std::size_t direction) {
  Flow& flow = pair.flows[direction];
  std::vector<std::byte> bytes(16384);
  const ssize_t n = ::read(flow.from, bytes.data(), bytes.size());
  if (n < 0 && (errno == EAGAIN || errno == EINTR)) return;
  if (n <= 0) {
    flow.ended = true;
    return;
  }
  bytes.resize(static_cast<std::size_t>(n));
  const std::lock_guard lock(mutex_);
  std::vector<std::byte>& carried = carried_[pair.number][direction];
  carried.insert(carried.end(), bytes.begin(), bytes.end());
  Clock::time_point due = Clock::now() + impairment_.delay;
  if (impairment_.jitter.count() > 0)
    due +=
        std::chrono::nanoseconds(std::uniform_int_distribution<std::int64_t>(0, impairment_.jitter.count())(random_));
  if (impairment_.bytes_per_s > 0) {
    flow.free_at =
        std::max(flow.free_at, Clock::now()) +
        std::chrono::nanoseconds(static_cast<std::int64_t>(1e9 * static_cast<double>(n) / impairment_.bytes_per_s));
    due = std::max(due, flow.free_at + impairment_.delay);
  }
  if (!flow.in_flight.empty()) due = std::max(due, flow.in_flight.back().due);
  flow.held_bytes += bytes.size();
  flow.in_flight.push_back({std::move(bytes), 0, due});
}

bool ImpairingProxy::write_due(Flow& flow) {
  while (!flow.in_flight.empty() && flow.in_flight.front().due <= Clock::now()) {
    Piece& piece = flow.in_flight.front();
    const ssize_t n =
        ::send(flow.to, piece.bytes.data() + piece.written, piece.bytes.size() - piece.written, MSG_NOSIGNAL);
    if (n < 0) return errno == EAGAIN || errno == EINTR;
    piece.written += static_cast<std::size_t>(n);
    if (piece.written < piece.bytes.size()) return true;
    flow.held_bytes -= piece.bytes.size();
    flow.in_flight.pop_front();
  }
  return !(flow.ended && flow.in_flight.empty());
}

void ImpairingProxy::run() {
  while (!stopping_) {
    if (cut_ && listener_ >= 0) {
      close_all();
      ::close(listener_);
      listener_ = -1;
    }
    if (!cut_ && listener_ < 0) listen_again();
    std::vector<pollfd> polled{{wake_[0], POLLIN, 0}};
    if (listener_ >= 0) polled.push_back({listener_, POLLIN, 0});
    const std::size_t first = polled.size();
    auto next = Clock::now() + std::chrono::milliseconds(50);
    for (Pair& pair : pairs_) {
      for (Flow& flow : pair.flows) {
        const bool wanted = !flow.ended && !held_ && flow.held_bytes < kMaxInFlightBytes;
        polled.push_back({wanted ? flow.from : -1, POLLIN, 0});
        const bool waiting = !held_ && !flow.in_flight.empty();
        const bool due = waiting && flow.in_flight.front().due <= Clock::now();
        polled.push_back({due ? flow.to : -1, POLLOUT, 0});
        if (waiting && !due) next = std::min(next, flow.in_flight.front().due);
      }
    }
    const auto wait = std::max(std::chrono::nanoseconds(next - Clock::now()), std::chrono::nanoseconds(0));
    const timespec timeout{wait.count() / 1'000'000'000, wait.count() % 1'000'000'000};
    ::ppoll(polled.data(), polled.size(), &timeout, nullptr);
    char drain[64];
    while (::read(wake_[0], drain, sizeof drain) > 0) {
    }
    if (cut_) continue;
    if (first == 2 && (polled[1].revents & POLLIN) != 0) accept_one();
    std::size_t at = first;
    for (auto pair = pairs_.begin(); pair != pairs_.end();) {
      bool over = false;
      // A pair that was accepted just now was not polled.
      if (at + 3 < polled.size()) {
        for (std::size_t direction = 0; direction < 2; ++direction, at += 2)
          if ((polled[at].revents & (POLLIN | POLLHUP | POLLERR)) != 0) read_some(*pair, direction);
      }
      if (!held_)
        for (Flow& flow : pair->flows) over = !write_due(flow) || over;
      if (over) {
        ::close(pair->flows[0].from);
        ::close(pair->flows[1].from);
        pair = pairs_.erase(pair);
      } else {
        ++pair;
      }
    }
  }
}

}  // namespace lightwell::test
