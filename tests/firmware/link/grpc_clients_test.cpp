// Clients that are slow, rude or many: the others do not notice.
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

/// A few of these fill what gRPC and the kernel keep for a client that does not read.
constexpr std::size_t kLarge = 60'000;

class GrpcClientsTest : public GrpcLinkTest {
 protected:
  /// Publishes `count` messages; this client must get each of them, whatever others do.
  void reaches(RawStream& reader, int count, std::size_t bytes = 16) {
    for (int i = 0; i < count; ++i) {
      const EncodedDescriptor sent = message(number_++, bytes);
      link_->publish(sent);
      ASSERT_EQ(reader.next(), text_of(sent)) << "waited for message " << number_ - 1;
    }
  }
  /// Until the link has left out some messages for somebody; that was not `reader`. Some, because
  /// a busy machine can make it leave out one for anybody.
  void publish_until_coalesced(RawStream& reader) {
    const std::uint64_t before = link_->counters().coalesced;
    for (int i = 0; i < 500 && link_->counters().coalesced < before + 10; ++i)
      ASSERT_NO_FATAL_FAILURE(reaches(reader, 1, kLarge));
    ASSERT_GE(link_->counters().coalesced, before + 10) << "500 large messages were taken unread";
  }
  int number_ = 0;
};

TEST_F(GrpcClientsTest, AClientThatDoesNotReadIsCoalescedAndTheOthersGetAll) {
  RawStream sleeper(connect(*link_)), reader(connect(*link_));
  ASSERT_TRUE(clients_become(2));
  ASSERT_NO_FATAL_FAILURE(publish_until_coalesced(reader));
  const std::uint64_t coalesced = link_->counters().coalesced;
  ASSERT_NO_FATAL_FAILURE(reaches(reader, 50));
  EXPECT_EQ(link_->counters().coalesced, coalesced + 50) << "the sleeper's, one for one";
}

TEST_F(GrpcClientsTest, AClientThatWakesUpFindsTheNewest) {
  RawStream sleeper(connect(*link_)), reader(connect(*link_));
  ASSERT_TRUE(clients_become(2));
  ASSERT_NO_FATAL_FAILURE(publish_until_coalesced(reader));
  ASSERT_NO_FATAL_FAILURE(reaches(reader, 10));
  const std::string newest = text_of(message(number_ - 1));
  int got = 0;
  for (;; ++got) {
    const std::optional<std::string> m = sleeper.next();
    ASSERT_TRUE(m) << "waited for the newest message";
    if (*m == newest) break;
  }
  EXPECT_LT(got, number_ - 10) << "what was coalesced never comes";
  ASSERT_NO_FATAL_FAILURE(reaches(sleeper, 10));
}

TEST_F(GrpcClientsTest, AClientThatCancelsIsForgotten) {
  RawStream reader(connect(*link_));
  for (int i = 0; i < 10; ++i) {
    RawStream visitor(connect(*link_));
    ASSERT_TRUE(clients_become(2));
    visitor.cancel();
    ASSERT_NO_FATAL_FAILURE(reaches(reader, 3));
    ASSERT_TRUE(clients_become(1));
  }
}

TEST_F(GrpcClientsTest, AClientThatVanishesWhileItIsBehindIsForgotten) {
  RawStream reader(connect(*link_));
  {
    RawStream sleeper(connect(*link_));
    ASSERT_TRUE(clients_become(2));
    ASSERT_NO_FATAL_FAILURE(publish_until_coalesced(reader));
  }
  ASSERT_TRUE(clients_become(1));
  ASSERT_NO_FATAL_FAILURE(reaches(reader, 20));
}

/// A TCP connection that knows nothing of gRPC.
class Intruder {
 public:
  Intruder(const Link& link, const std::string& bytes) {
    const std::string address = host_port(link);
    const sockaddr_in to = loopback(std::stoi(address.substr(address.rfind(':') + 1)));
    EXPECT_EQ(::connect(socket_, reinterpret_cast<const sockaddr*>(&to), sizeof to), 0);
    ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
  }
  Intruder(const Intruder&) = delete;
  Intruder& operator=(const Intruder&) = delete;
  /// With a reset, as when a machine is switched off and comes back.
  ~Intruder() {
    const linger hard{1, 0};
    ::setsockopt(socket_, SOL_SOCKET, SO_LINGER, &hard, sizeof hard);
    ::close(socket_);
  }

 private:
  int socket_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
};

TEST_F(GrpcClientsTest, ConnectionsThatAreNoClientsDisturbNobody) {
  RawStream reader(connect(*link_));
  ASSERT_TRUE(clients_become(1));
  const std::string preface = "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n";
  const std::string settings("\x00\x00\x00\x04\x00\x00\x00\x00\x00", 9);
  for (const std::string& bytes : {std::string(), std::string("GET / HTTP/1.0\r\n\r\n"), std::string(100'000, '\xff'),
                                   preface.substr(0, 12), preface, preface + settings + std::string(500, '\xee')}) {
    {
      const Intruder open_for_a_while(*link_, bytes), one_more(*link_, bytes);
      ASSERT_NO_FATAL_FAILURE(reaches(reader, 5));
    }
    ASSERT_NO_FATAL_FAILURE(reaches(reader, 5));
  }
  EXPECT_EQ(link_->counters().clients, 1U);
  EXPECT_EQ(link_->counters().coalesced, 0U);
}

TEST_F(GrpcClientsTest, ThirtyTwoClientsTakeNoMoreThreadsThanOne) {
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
  // gRPC's own pools grow with the work, up to two threads a core: they are filled first.
  crowd_of(32);
  ASSERT_TRUE(clients_become(0));
  const long with_one = crowd_of(1);
  ASSERT_TRUE(clients_become(0));
  const long with_many = crowd_of(32);
  EXPECT_GT(with_one, 0);
  EXPECT_LT(with_many - with_one, 4) << "a thread a client would be 31 more";
}

}  // namespace
}  // namespace lightwell::test
