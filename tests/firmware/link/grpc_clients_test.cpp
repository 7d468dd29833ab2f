// Slow, disconnecting and many clients of the gRPC link do not affect others.
#include <cstring>
#include <unistd.h>

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include "firmware/link/probe_server.hpp"
#include "support/child.hpp"
#include "support/loopback.hpp"

namespace lightwell::test {
namespace {

/// A few messages of this size fill the buffers of gRPC and the kernel for a client that does not read.
constexpr std::size_t kLarge = 60'000;

class GrpcClientsTest : public GrpcLinkTest {
 protected:
  /// Publishes `count` messages, of which `reader` must receive each.
  void expect_received(RawStream& reader, int count, std::size_t bytes = 16) {
    for (int i = 0; i < count; ++i) {
      const EncodedDescriptor sent = message(number_++, bytes);
      link_->publish(sent);
      ASSERT_EQ(reader.next(), text_of(sent)) << "waited for message " << number_ - 1;
    }
  }
  /// Publishes until the link has coalesced ten messages, none of them for `reader`. Ten, because on a busy machine a
  /// single one may be coalesced for any client.
  void publish_until_coalesced(RawStream& reader) {
    const std::uint64_t before = link_->counters().coalesced;
    for (int i = 0; i < 500 && link_->counters().coalesced < before + 10; ++i)
      ASSERT_NO_FATAL_FAILURE(expect_received(reader, 1, kLarge));
    ASSERT_GE(link_->counters().coalesced, before + 10) << "500 large messages were buffered without being read";
  }
  int number_ = 0;
};

TEST_F(GrpcClientsTest, ASlowClientIsCoalescedAndOthersReceiveAll) {
  RawStream slow(connect(*link_)), reader(connect(*link_));
  ASSERT_TRUE(clients_become(2));
  ASSERT_NO_FATAL_FAILURE(publish_until_coalesced(reader));
  const std::uint64_t coalesced = link_->counters().coalesced;
  ASSERT_NO_FATAL_FAILURE(expect_received(reader, 50));
  EXPECT_EQ(link_->counters().coalesced, coalesced + 50) << "all for the slow client";
}

TEST_F(GrpcClientsTest, AClientThatResumesReadingReceivesTheNewest) {
  RawStream slow(connect(*link_)), reader(connect(*link_));
  ASSERT_TRUE(clients_become(2));
  ASSERT_NO_FATAL_FAILURE(publish_until_coalesced(reader));
  ASSERT_NO_FATAL_FAILURE(expect_received(reader, 10));
  const std::string newest = text_of(message(number_ - 1));
  int got = 0;
  for (;; ++got) {
    const std::optional<std::string> m = slow.next();
    ASSERT_TRUE(m) << "waited for the newest message";
    if (*m == newest) break;
  }
  EXPECT_LT(got, number_ - 10) << "coalesced messages are not delivered";
  ASSERT_NO_FATAL_FAILURE(expect_received(slow, 10));
}

TEST_F(GrpcClientsTest, ACancelledClientIsRemoved) {
  RawStream reader(connect(*link_));
  for (int i = 0; i < 10; ++i) {
    RawStream visitor(connect(*link_));
    ASSERT_TRUE(clients_become(2));
    visitor.cancel();
    ASSERT_NO_FATAL_FAILURE(expect_received(reader, 3));
    ASSERT_TRUE(clients_become(1));
  }
}

TEST_F(GrpcClientsTest, ASlowClientThatDisconnectsIsRemoved) {
  RawStream reader(connect(*link_));
  {
    RawStream slow(connect(*link_));
    ASSERT_TRUE(clients_become(2));
    ASSERT_NO_FATAL_FAILURE(publish_until_coalesced(reader));
  }
  ASSERT_TRUE(clients_become(1));
  ASSERT_NO_FATAL_FAILURE(expect_received(reader, 20));
}

/// A TCP connection that sends arbitrary bytes.
class RawTcpConnection {
 public:
  RawTcpConnection(const Link& link, const std::string& bytes) {
    const std::string address = host_port(link);
    const sockaddr_in to = loopback(std::stoi(address.substr(address.rfind(':') + 1)));
    EXPECT_EQ(::connect(socket_, reinterpret_cast<const sockaddr*>(&to), sizeof to), 0);
    ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
  }
  RawTcpConnection(const RawTcpConnection&) = delete;
  RawTcpConnection& operator=(const RawTcpConnection&) = delete;
  /// Closes with a reset (RST), like a machine that was switched off and restarted.
  ~RawTcpConnection() {
    const linger hard{1, 0};
    ::setsockopt(socket_, SOL_SOCKET, SO_LINGER, &hard, sizeof hard);
    ::close(socket_);
  }

 private:
  int socket_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
};

TEST_F(GrpcClientsTest, OtherConnectionsDoNotAffectClients) {
  RawStream reader(connect(*link_));
  ASSERT_TRUE(clients_become(1));
  const std::string preface = "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n";
  const std::string settings("\x00\x00\x00\x04\x00\x00\x00\x00\x00", 9);
  for (const std::string& bytes : {std::string(), std::string("GET / HTTP/1.0\r\n\r\n"), std::string(100'000, '\xff'),
                                   preface.substr(0, 12), preface, preface + settings + std::string(500, '\xee')}) {
    {
      const RawTcpConnection open_for_a_while(*link_, bytes), one_more(*link_, bytes);
      ASSERT_NO_FATAL_FAILURE(expect_received(reader, 5));
    }
    ASSERT_NO_FATAL_FAILURE(expect_received(reader, 5));
  }
  EXPECT_EQ(link_->counters().clients, 1U);
  EXPECT_EQ(link_->counters().coalesced, 0U);
}

TEST_F(GrpcClientsTest, TheNumberOfThreadsDoesNotDependOnTheNumberOfClients) {
  const auto threads = [] { return proc_status_number(::getpid(), "Threads"); };
  const auto crowd_of = [&](std::size_t count) {
    std::vector<std::unique_ptr<RawStream>> crowd;
    while (crowd.size() < count) crowd.push_back(std::make_unique<RawStream>(connect(*link_)));
    EXPECT_TRUE(clients_become(static_cast<std::uint32_t>(count)));
    for (int i = 0; i < 20; ++i) {
      const EncodedDescriptor sent = message(number_++, 500);
      link_->publish(sent);
      for (const auto& stream : crowd) EXPECT_EQ(stream->next(), text_of(sent));
    }
    return threads();
  };
  // gRPC's thread pools grow with load up to two threads per core: fill them first.
  crowd_of(32);
  ASSERT_TRUE(clients_become(0));
  const long with_one = crowd_of(1);
  ASSERT_TRUE(clients_become(0));
  const long with_many = crowd_of(32);
  EXPECT_GT(with_one, 0);
  EXPECT_LT(with_many - with_one, 4) << "with one thread per client it would be 31 more";
}

}  // namespace
}  // namespace lightwell::test
