#include "usb_camera/server.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <poll.h>
#include <unistd.h>
#include <vector>

#include <sys/eventfd.h>
#include <sys/socket.h>
#include <sys/un.h>

namespace lightwell::usb_camera {
namespace {

constexpr std::size_t kMaxClients = 8, kMaxLineBytes = 4096, kMaxUnreadBytes = std::size_t{16} << 20;

Result<sockaddr_un> address_of(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.empty() || path.size() >= sizeof address.sun_path)
    return Status(StatusCode::invalid_argument, "the socket's path '" + path + "' must have 1 to 107 bytes");
  std::memcpy(address.sun_path, path.data(), path.size());
  return address;
}

const sockaddr* generic(const sockaddr_un& address) { return reinterpret_cast<const sockaddr*>(&address); }

CameraTime camera_now() { return {monotonic_now_ns()}; }

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

Result<std::unique_ptr<Server>> Server::open(const ServerOptions& options, CommandTargets targets) {
  std::unique_ptr<Server> server(new Server(std::move(targets)));
  server->targets_.cable = server.get();
  server->targets_.sink = server.get();
  Result<Listener> redir = Listener::at(options.redir_path);
  if (!redir) return redir.status();
  server->redir_ = std::move(*redir);
  if (!options.control_path.empty()) {
    Result<Listener> control = Listener::at(options.control_path);
    if (!control) return control.status();
    server->control_ = std::move(*control);
  }
  server->event_ = FileDescriptor(::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC));
  if (!server->event_)
    return Status(StatusCode::resource_exhausted, std::string("no eventfd: ") + std::strerror(errno));
  return server;
}

Server::~Server() = default;

void Server::wake() {
  const std::uint64_t one = 1;
  // If the counter is full, the thread wakes up anyway.
  [[maybe_unused]] const ssize_t written = ::write(event_.get(), &one, sizeof one);
}

void Server::stop() {
  stopping_ = true;
  wake();
}

void Server::complete(std::uint64_t id, TransferStatus status, std::span<const std::uint8_t> data) {
  if (port_ != nullptr) port_->complete(id, status, data);
}

void Server::close_port() {
  port_.reset();
  targets_.device->stream().reset();
}

void Server::unplug(bool close) {
  plugged_ = false;
  targets_.device->stream().reset();
  if (port_ == nullptr) return;
  port_->unplug();
  if (!close) return;
  // This message need not arrive: the end of the connection has the same meaning.
  (void)port_->write();
  close_port();
}

void Server::plug() {
  plugged_ = true;
  targets_.device->power_on();
  if (port_ != nullptr) port_->plug();
}

void Server::serve_port() {
  if (port_ == nullptr && plugged_) {
    if (FileDescriptor host = redir_->accept()) {
      targets_.device->power_on();
      port_ = std::make_unique<RedirPort>(*targets_.device, std::move(host), plugged_);
    }
  }
  if (port_ == nullptr) return;
  const bool alive = !port_->wants_read() || port_->read();
  targets_.device->stream().run(camera_now(), *port_);
  if (!alive || !port_->write()) close_port();
}

bool Server::serve(Client& client) {
  std::array<char, 4096> buffer{};
  const ssize_t n = ::recv(client.socket.get(), buffer.data(), buffer.size(), MSG_DONTWAIT);
  if (n == 0 || (n < 0 && errno != EAGAIN && errno != EINTR)) return false;
  if (n > 0) client.in.append(buffer.data(), static_cast<std::size_t>(n));
  for (std::size_t end = client.in.find('\n'); end != std::string::npos; end = client.in.find('\n')) {
    client.out += execute_command(std::string_view(client.in).substr(0, end), targets_, camera_now()) + "\n";
    client.in.erase(0, end + 1);
  }
  const ssize_t sent = ::send(client.socket.get(), client.out.data(), client.out.size(), MSG_DONTWAIT | MSG_NOSIGNAL);
  if (sent > 0) client.out.erase(0, static_cast<std::size_t>(sent));
  return client.in.size() <= kMaxLineBytes && client.out.size() <= kMaxUnreadBytes;
}

void Server::serve_clients() {
  if (!control_) return;
  for (FileDescriptor socket = control_->accept(); socket; socket = control_->accept()) {
    if (clients_.size() < kMaxClients) clients_.push_back({std::move(socket), {}, {}});
  }
  clients_.remove_if([this](Client& client) { return !serve(client); });
}

Status Server::wait() {
  std::vector<pollfd> fds = {{event_.get(), POLLIN, 0}};
  // While a host is connected, or the camera is unplugged, the next host waits in the socket's queue.
  if (port_ == nullptr && plugged_) fds.push_back({redir_->get(), POLLIN, 0});
  if (port_ != nullptr) {
    const int events = (port_->wants_read() ? POLLIN : 0) | (port_->wants_write() ? POLLOUT : 0);
    fds.push_back({port_->socket(), static_cast<short>(events), 0});
  }
  if (control_) fds.push_back({control_->get(), POLLIN, 0});
  for (const Client& client : clients_)
    fds.push_back({client.socket.get(), static_cast<short>(POLLIN | (client.out.empty() ? 0 : POLLOUT)), 0});

  std::optional<std::timespec> timeout;
  if (const std::optional<CameraTime> due = targets_.device->stream().next_due(); due && port_ != nullptr) {
    const std::int64_t ns = std::max<std::int64_t>(0, (*due - camera_now()).ns);
    timeout = std::timespec{static_cast<std::time_t>(ns / 1'000'000'000), static_cast<long>(ns % 1'000'000'000)};
  }
  if (::ppoll(fds.data(), fds.size(), timeout ? &*timeout : nullptr, nullptr) < 0 && errno != EINTR)
    return {StatusCode::unavailable, std::string("poll: ") + std::strerror(errno)};
  std::uint64_t events = 0;
  [[maybe_unused]] const ssize_t read = ::read(event_.get(), &events, sizeof events);
  return {};
}

Status Server::run() {
  while (!stopping_) {
    if (Status waited = wait(); !waited.ok()) return waited;
    serve_clients();
    serve_port();
  }
  // Closing the connection tells the host that the camera has gone.
  close_port();
  return {};
}

}  // namespace lightwell::usb_camera
