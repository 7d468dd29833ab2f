#include "support/broker.hpp"

#include <csignal>
#include <unistd.h>

#include <arpa/inet.h>
#include <sys/socket.h>

#include "support/loopback.hpp"

namespace lightwell::test {
namespace {

bool is_listening(int port) {
  const int s = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const sockaddr_in address = loopback(port);
  const bool yes = ::connect(s, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  ::close(s);
  return yes;
}

}  // namespace

int free_port() {
  const int s = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address = loopback(0);
  socklen_t size = sizeof address;
  EXPECT_EQ(::bind(s, reinterpret_cast<const sockaddr*>(&address), size), 0);
  ::getsockname(s, reinterpret_cast<sockaddr*>(&address), &size);
  ::close(s);
  return ntohs(address.sin_port);
}

Broker::Broker(BrokerOptions options) : options_(std::move(options)), port_(free_port()) {
  // `user root`: started by root, mosquitto would otherwise switch to a user who cannot read the test's folder.
  std::string conf =
      "listener " + std::to_string(port_) + " 127.0.0.1\nuser root\nset_tcp_nodelay true\nlog_dest stderr\n";
  if (options_.users.empty()) {
    conf += "allow_anonymous true\n";
  } else {
    std::string lines;
    for (const auto& [user, password] : options_.users) lines += user + ":" + password + "\n";
    const std::string file = folder_.write("passwords", lines);
    Child hashed({LIGHTWELL_MOSQUITTO_PASSWD, "-U", file});
    EXPECT_EQ(hashed.wait(), (ExitStatus{0, 0})) << hashed.err();
    conf += "allow_anonymous false\npassword_file " + file + "\n";
  }
  if (options_.tls) conf += "certfile " + options_.tls->certificate + "\nkeyfile " + options_.tls->key + "\n";
  if (!options_.client_ca.empty()) conf += "cafile " + options_.client_ca + "\nrequire_certificate true\n";
  folder_.write("mosquitto.conf", conf + options_.more);
  start();
}

void Broker::start() {
  child_.emplace(std::vector<std::string>{LIGHTWELL_MOSQUITTO, "-c", folder_.path("mosquitto.conf")});
  EXPECT_TRUE(becomes_true("the broker listens", [&] { return child_->exit_status() || is_listening(port_); }));
  EXPECT_FALSE(child_->exit_status()) << child_->err();
}

void Broker::stop() {
  child_->signal(SIGTERM);
  (void)child_->wait();
}

std::string Broker::uri(const std::string& base) const {
  return (options_.tls ? "mqtts" : "mqtt") + ("://127.0.0.1:" + std::to_string(port_)) + "/" + base;
}

}  // namespace lightwell::test
