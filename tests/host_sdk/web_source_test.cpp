// The SDK's WebSocket connection to servers that are broken or hostile: scripts on plain TCP sockets.
#include <atomic>
#include <functional>
#include <optional>
#include <poll.h>
#include <string>
#include <thread>
#include <unistd.h>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <openssl/evp.h>
#include <openssl/sha.h>
#include <sys/socket.h>

#include <lightwell/codec.hpp>
#include <lightwell/probe.hpp>
#include <lightwell/time.hpp>

#include "lightwell/v1/link_message.pb.h"
#include "support/loopback.hpp"
#include "support/wait.hpp"

namespace lightwell::test {
namespace {

using ::testing::HasSubstr;

/// A frame as servers send it: not masked (RFC 6455, section 5.2).
std::string frame(const std::string& payload, int first_byte = 0x82) {
  std::string out(1, static_cast<char>(first_byte));
  if (payload.size() < 126) {
    out += static_cast<char>(payload.size());
  } else if (payload.size() < 65536) {
    out += {'\x7e', static_cast<char>(payload.size() >> 8U), static_cast<char>(payload.size())};
  } else {
    out += '\x7f';
    for (int shift = 56; shift >= 0; shift -= 8)
      out += static_cast<char>(payload.size() >> static_cast<unsigned>(shift));
  }
  return out + payload;
}

std::string descriptor(std::uint64_t sequence) {
  Descriptor d;
  d.sequence = sequence;
  d.time.mid_exposure = {monotonic_now_ns()};
  d.coverage = 1;
  Encoder encoder;
  const auto bytes = encoder.encode(d);
  EXPECT_TRUE(bytes.ok()) << bytes.status().message();
  return {reinterpret_cast<const char*>(bytes->data()), bytes->size()};
}

/// One connection of a client, after its request was read.
class Conversation {
 public:
  explicit Conversation(int socket) : socket_(socket) {
    while (request_.find("\r\n\r\n") == std::string::npos && receive()) {
    }
    received_ = request_.substr(std::min(request_.find("\r\n\r\n") + 4, request_.size()));
  }
  Conversation(const Conversation&) = delete;
  Conversation& operator=(const Conversation&) = delete;
  ~Conversation() { ::close(socket_); }

  [[nodiscard]] const std::string& request() const { return request_; }
  void send(const std::string& bytes) const { (void)!::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL); }
  void accept_upgrade() {
    if (request_.find("\r\n\r\n") == std::string::npos) return;
    const std::string name = "ec-WebSocket-Key: ";
    const std::size_t at = request_.find(name) + name.size();
    const std::string key = request_.substr(at, request_.find('\r', at) - at) + "258EAFA5-E914-47DA-95CA-C5AB0DC85B11";
    unsigned char digest[SHA_DIGEST_LENGTH], text[64];
    SHA1(reinterpret_cast<const unsigned char*>(key.data()), key.size(), digest);
    EVP_EncodeBlock(text, digest, sizeof digest);
    send("HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Accept: " +
         std::string(reinterpret_cast<const char*>(text)) + "\r\nSec-WebSocket-Protocol: lightwell.v1\r\n\r\n");
  }
  /// Answers the next request of Info; false if the client has gone.
  bool answer_info() {
    const std::optional<std::string> request = next_message();
    v1::LinkRequest asked;
    if (!request || !asked.ParseFromString(*request)) return false;
    v1::LinkResponse response;
    response.set_id(asked.id());
    response.mutable_info()->set_probe_name("scripted");
    response.mutable_info()->set_clock_now_ns(static_cast<std::uint64_t>(monotonic_now_ns()));
    send(frame(response.SerializeAsString()));
    return true;
  }
  /// The payload of the client's next frame, which is short.
  std::optional<std::string> next_message() {
    while (received_.size() < 6 || received_.size() < 6 + length())
      if (!receive()) return std::nullopt;
    EXPECT_NE(received_[1] & 0x80, 0) << "a client masks";
    std::string out = received_.substr(6, length());
    for (std::size_t i = 0; i < out.size(); ++i) out[i] = static_cast<char>(out[i] ^ received_[2 + i % 4]);
    received_.erase(0, 6 + length());
    return out;
  }

 private:
  [[nodiscard]] std::size_t length() const { return static_cast<std::size_t>(received_[1] & 0x7f); }
  bool receive() {
    char bytes[4096];
    const ssize_t got = ::recv(socket_, bytes, sizeof bytes, 0);
    if (got <= 0) return false;
    request_.append(bytes, static_cast<std::size_t>(got));
    received_.append(bytes, static_cast<std::size_t>(got));
    return true;
  }

  const int socket_;
  std::string request_, received_;
};

/// Plays one script for each connection, one after the other.
class ScriptedServer {
 public:
  using Script = std::function<void(Conversation&)>;

  explicit ScriptedServer(Script script) : script_(std::move(script)) {
    sockaddr_in address = loopback(0);
    socklen_t length = sizeof address;
    EXPECT_EQ(::bind(socket_, reinterpret_cast<const sockaddr*>(&address), length), 0);
    EXPECT_EQ(::listen(socket_, 8), 0);
    ::getsockname(socket_, reinterpret_cast<sockaddr*>(&address), &length);
    uri_ = "ws://127.0.0.1:" + std::to_string(ntohs(address.sin_port));
    thread_ = std::thread([this] {
      while (!stopping_) {
        pollfd readable{socket_, POLLIN, 0};
        if (::poll(&readable, 1, 20) <= 0) continue;
        Conversation one(::accept(socket_, nullptr, nullptr));
        ++connections_;
        script_(one);
      }
    });
  }
  ScriptedServer(const ScriptedServer&) = delete;
  ScriptedServer& operator=(const ScriptedServer&) = delete;
  ~ScriptedServer() {
    stopping_ = true;
    thread_.join();
    ::close(socket_);
  }
  [[nodiscard]] const std::string& uri() const { return uri_; }
  [[nodiscard]] int connections() const { return connections_; }

 private:
  const Script script_;
  const int socket_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  std::string uri_;
  std::atomic<bool> stopping_{false};
  std::atomic<int> connections_{0};
  std::thread thread_;
};

ProbeOptions options() {
  ProbeOptions o;
  o.connect_timeout = Duration::from_seconds(20);
  o.retry_min = {1'000'000};
  o.retry_max = {20'000'000};
  o.max_age = Duration::from_seconds(60);
  o.silence_limit = Duration::from_seconds(2);
  return o;
}

/// Answers until the client leaves.
void answer_all(Conversation& c) {
  while (c.answer_info()) {
  }
}

TEST(WebSource, RequestsTheSubprotocolAtThePath) {
  std::string request;
  std::atomic<bool> seen{false};
  {
    ScriptedServer server([&](Conversation& c) {
      if (!seen) request = c.request();
      seen = true;
      c.accept_upgrade();
      answer_all(c);
    });
    EXPECT_TRUE(Probe::connect(server.uri(), options()).ok());
  }
  EXPECT_THAT(request, HasSubstr("GET /v1/descriptors HTTP/1.1\r\n"));
  EXPECT_THAT(request, HasSubstr("lightwell.v1"));
}

TEST(WebSource, InvalidMessagesAreCountedAndTheConnectionStays) {
  ScriptedServer server([&](Conversation& c) {
    c.accept_upgrade();
    (void)c.answer_info();
    (void)c.answer_info();
    c.send(frame("neither a descriptor nor a response"));
    c.send(frame(std::string("\x08\xff\xff", 3)));
    c.send(frame(""));
    c.send(frame(std::string(70'000, '\x08')));
    c.send(frame(descriptor(1)));
    // In two fragments with a ping between them.
    const std::string second = descriptor(2);
    c.send(frame(second.substr(0, 10), 0x02) + frame("ping", 0x89) + frame(second.substr(10), 0x80));
    while (c.next_message()) {
    }
  });
  const Result<Probe> probe = Probe::connect(server.uri(), options());
  ASSERT_TRUE(probe.ok()) << probe.status().message();
  EXPECT_TRUE(becomes_true("both descriptors arrive", [&] { return probe->stats().received == 2; }));
  EXPECT_EQ(probe->latest().descriptor().sequence, 2U);
  EXPECT_EQ(probe->stats().oversized, 1U);
  EXPECT_EQ(probe->stats().undecodable, 2U) << "an empty message is a response for which nobody waits";
  EXPECT_EQ(server.connections(), 1);
}

TEST(WebSource, ASilentServerIsLeftAfterTheSilenceLimit) {
  ScriptedServer server([&](Conversation& c) {
    c.accept_upgrade();
    (void)c.answer_info();
    (void)c.answer_info();
    while (c.next_message()) {
    }
  });
  const Result<Probe> probe = Probe::connect(server.uri(), options());
  ASSERT_TRUE(probe.ok()) << probe.status().message();
  EXPECT_TRUE(becomes_true("it connects again", [&] { return server.connections() >= 2; }));
  EXPECT_THAT(probe->stats().last_error, HasSubstr("silence_limit"));
}

TEST(WebSource, ServersThatAreNoneAreErrors) {
  for (const auto& script : std::vector<ScriptedServer::Script>{
           [](Conversation& c) { c.send("HTTP/1.1 404 Not Found\r\ncontent-length: 0\r\n\r\n"); },
           [](Conversation& c) { c.send(std::string(20'000, 'x')); }, [](Conversation&) {},
           [](Conversation& c) {
             c.accept_upgrade();
             c.send(frame(std::string("\x03\xf0", 2) + "not authenticated: pair", 0x88));
           },
           [](Conversation& c) {
             c.accept_upgrade();
             c.send("\xff\xff\xff\xff\xff\xff");
           }}) {
    ScriptedServer server(script);
    ProbeOptions o = options();
    o.connect_timeout = Duration::from_seconds(0.5);
    const Result<Probe> probe = Probe::connect(server.uri(), o);
    ASSERT_FALSE(probe.ok());
    EXPECT_EQ(probe.status().code(), StatusCode::unavailable);
    EXPECT_THAT(probe.status().message(), HasSubstr(server.uri()));
    EXPECT_GT(server.connections(), 1) << "it tries again";
  }
}

TEST(WebSource, TheReasonOfACloseIsTheError) {
  ScriptedServer server([](Conversation& c) {
    c.accept_upgrade();
    c.send(frame(std::string("\x03\xf0", 2) + "not authenticated: pair", 0x88));
    (void)c.next_message();
  });
  ProbeOptions o = options();
  o.connect_timeout = Duration::from_seconds(0.5);
  EXPECT_THAT(Probe::connect(server.uri(), o).status().message(), HasSubstr("not authenticated: pair"));
}

}  // namespace
}  // namespace lightwell::test
