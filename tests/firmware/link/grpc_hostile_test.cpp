// The gRPC link under malformed, too large and hostile input: it refuses and counts it, and continues to serve others.
#include <array>
#include <poll.h>
#include <random>
#include <unistd.h>

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include "firmware/link/probe_server.hpp"
#include "support/loopback.hpp"

namespace lightwell::test {
namespace {

using ::testing::HasSubstr;

const std::string kService = "/lightwell.v1.ProbeService/";

/// A TCP connection for arbitrary bytes.
class RawConnection {
 public:
  explicit RawConnection(const Link& link) : socket_(::socket(AF_INET, SOCK_STREAM, 0)) {
    const std::string address = host_port(link);
    const sockaddr_in to = loopback(std::stoi(address.substr(address.rfind(':') + 1)));
    EXPECT_EQ(::connect(socket_, reinterpret_cast<const sockaddr*>(&to), sizeof to), 0);
  }
  RawConnection(const RawConnection&) = delete;
  RawConnection& operator=(const RawConnection&) = delete;
  ~RawConnection() { ::close(socket_); }

  /// False if the other side has closed the connection.
  bool send(const std::string& bytes) const {
    return ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(bytes.size());
  }
  /// Reads until the other side closes the connection or sends nothing for `silence`.
  std::string drain(std::chrono::milliseconds silence) const {
    std::string out;
    std::array<char, 4096> buffer{};
    pollfd ready{socket_, POLLIN, 0};
    while (::poll(&ready, 1, static_cast<int>(silence.count())) > 0) {
      const ssize_t n = ::recv(socket_, buffer.data(), buffer.size(), 0);
      if (n <= 0) break;
      out.append(buffer.data(), static_cast<std::size_t>(n));
    }
    return out;
  }

 private:
  const int socket_;
};

/// An HTTP/2 frame (RFC 9113, section 4.1).
std::string frame(char type, char flags, std::uint32_t stream, const std::string& payload) {
  std::string out;
  for (const unsigned shift : {16U, 8U, 0U}) out += static_cast<char>(payload.size() >> shift);
  out += type;
  out += flags;
  for (const unsigned shift : {24U, 16U, 8U, 0U}) out += static_cast<char>(stream >> shift);
  return out + payload;
}
const std::string kPreface = "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n";
constexpr char kSettings = 4, kPing = 6;

class GrpcHostileTest : public GrpcLinkTest {
 protected:
  [[nodiscard]] ::testing::AssertionResult serves() const {
    const Reply reply = call(connect(*link_), kService + "Info", "");
    if (reply.status.ok()) return ::testing::AssertionSuccess();
    return ::testing::AssertionFailure() << reply.status.error_message();
  }
  [[nodiscard]] std::uint64_t refused() const { return link_->counters().messages_refused; }
};

TEST_F(GrpcHostileTest, MalformedRequestsToEveryMethodAreRefusedAndCounted) {
  const std::shared_ptr<grpc::Channel> channel = connect(*link_);
  // Field number 0; a length beyond the end; an unterminated varint; an unterminated group.
  const std::vector<std::string> garbage = {std::string("\0", 1), "\x0a\x7f", std::string(11, '\xff'), "\x0b"};
  std::uint64_t sent = 0;
  for (const char* method : {"Info", "GetDescriptor", "SetConfig", "ReportLux", "StreamDescriptors", "StreamPlane"})
    for (const std::string& bytes : garbage) {
      const Reply reply = call(channel, kService + method, bytes);
      EXPECT_EQ(reply.status.error_code(), grpc::StatusCode::INVALID_ARGUMENT) << method;
      EXPECT_THAT(reply.status.error_message(), HasSubstr("probe_service.proto"));
      EXPECT_EQ(refused(), ++sent) << method;
    }
  EXPECT_TRUE(serves());
  EXPECT_EQ(link_->counters().clients, 0U);
}

TEST_F(GrpcHostileTest, ATruncatedRequestIsRefusedOrParsedAsWhatIsLeft) {
  const std::shared_ptr<grpc::Channel> channel = connect(*link_);
  // ReportLux: lux 5, normal +Y; each field is a tag and eight bytes.
  const std::string whole("\x09\x00\x00\x00\x00\x00\x00\x14\x40\x19\x00\x00\x00\x00\x00\x00\xf0\x3f", 18);
  ASSERT_TRUE(call(channel, kService + "ReportLux", whole).status.ok());
  for (std::size_t n = 0; n < whole.size(); ++n) {
    const grpc::Status s = call(channel, kService + "ReportLux", whole.substr(0, n)).status;
    EXPECT_EQ(s.error_code(), grpc::StatusCode::INVALID_ARGUMENT) << n;
  }
  EXPECT_EQ(refused(), whole.size() - 2) << "the empty message and lux without a normal are well-formed";
}

TEST_F(GrpcHostileTest, SurvivesRandomBytes) {
  std::mt19937 random(7);
  const std::shared_ptr<grpc::Channel> channel = connect(*link_);
  for (int i = 0; i < 500; ++i) {
    std::string bytes(random() % 64, '\0');
    for (char& c : bytes) c = static_cast<char>(random());
    for (const char* method : {"SetConfig", "ReportLux"}) (void)call(channel, kService + method, bytes);
  }
  EXPECT_GT(refused(), 500U);
  EXPECT_TRUE(serves());
}

TEST_F(GrpcHostileTest, ATooLargeRequestIsRefusedAndCountedAndTheConnectionStaysOpen) {
  const std::shared_ptr<grpc::Channel> channel = connect(*link_);
  for (const char* method : {"Info", "GetDescriptor", "SetConfig", "ReportLux", "StreamDescriptors", "StreamPlane"}) {
    const std::uint64_t before = refused();
    EXPECT_EQ(call(channel, kService + method, std::string(4097, '\0')).status.error_code(),
              grpc::StatusCode::RESOURCE_EXHAUSTED)
        << method;
    EXPECT_EQ(refused(), before + 1) << method;
  }
  EXPECT_TRUE(call(channel, kService + "Info", "").status.ok());
}

TEST_F(GrpcHostileTest, AMessageOfMegabytesIsRefusedUnreadAndCounted) {
  const std::shared_ptr<grpc::Channel> channel = connect(*link_);
  std::uint64_t sent = 0;
  for (const std::size_t bytes : {std::size_t{65 * 1024}, std::size_t{1} << 20, std::size_t{8} << 20}) {
    EXPECT_EQ(call(channel, kService + "SetConfig", std::string(bytes, 'x')).status.error_code(),
              grpc::StatusCode::RESOURCE_EXHAUSTED)
        << bytes;
    ++sent;
    EXPECT_TRUE(becomes_true("the message is counted", [&] { return refused() == sent; })) << refused();
  }
  EXPECT_TRUE(serves());
}

TEST_F(GrpcHostileTest, AnUnknownMethodIsUnimplemented) {
  EXPECT_EQ(call(connect(*link_), kService + "Explode", "x").status.error_code(), grpc::StatusCode::UNIMPLEMENTED);
  EXPECT_TRUE(serves());
}

TEST_F(GrpcHostileTest, SurvivesConnectionsThatAreNotHttp2) {
  for (const std::string& bytes :
       {std::string("GET / HTTP/1.1\r\nHost: x\r\n\r\n"), std::string(4096, '\0'), std::string(4096, '\xff'),
        std::string("\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03"), kPreface.substr(0, 10) + "x",
        kPreface + std::string(9, '\xff'), kPreface + frame(kSettings, 0, 0, std::string(5, 'x')),
        // HEADERS with invalid HPACK; DATA on a stream that was not opened; a frame length of 16 MiB.
        kPreface + frame(kSettings, 0, 0, "") + frame(1, 4, 1, std::string(64, '\xff')),
        kPreface + frame(kSettings, 0, 0, "") + frame(0, 0, 1, "x"),
        kPreface + frame(kSettings, 0, 0, "") + std::string("\xff\xff\xff\x00\x00\x00\x00\x00\x01", 9)}) {
    const RawConnection connection(*link_);
    EXPECT_TRUE(connection.send(bytes));
    (void)connection.drain(std::chrono::milliseconds(50));
    EXPECT_TRUE(serves());
  }
}

TEST_F(GrpcHostileTest, DisconnectsAClientThatFloodsPings) {
  const RawConnection connection(*link_);
  ASSERT_TRUE(connection.send(kPreface + frame(kSettings, 0, 0, "")));
  for (int i = 0; i < 100; ++i)
    if (!connection.send(frame(kPing, 0, 0, "12345678"))) break;
  EXPECT_THAT(connection.drain(std::chrono::milliseconds(2000)), HasSubstr("too_many_pings"));
  EXPECT_TRUE(serves());
}

TEST_F(GrpcHostileTest, LimitsTheStreamsOfAConnectionAndServesOthers) {
  const std::shared_ptr<grpc::Channel> greedy = connect(*link_);
  std::vector<std::unique_ptr<RawStream>> streams;
  for (int i = 0; i < 32; ++i) streams.push_back(std::make_unique<RawStream>(greedy));
  ASSERT_TRUE(clients_become(32));
  // The next stream waits in the client until another one ends.
  std::thread next([&] {
    RawStream waiting(greedy);
    EXPECT_TRUE(clients_become(32));
  });
  EXPECT_TRUE(serves());
  EXPECT_EQ(link_->counters().clients, 32U);
  streams.pop_back();
  next.join();
}

// Like a client that abandoned its connection while the network was down, so that no packet ended it.
TEST_F(GrpcHostileTest, ClosesAnIdleConnectionThatAnswersNoPing) {
  const RawConnection gone(*link_);
  ASSERT_TRUE(gone.send(kPreface + frame(kSettings, 0, 0, "") + frame(kSettings, 1, 0, "")));
  const auto begun = std::chrono::steady_clock::now();
  gone.drain(std::chrono::seconds(40));
  // The server closes it after 15 s; otherwise drain() would have waited for 40 s.
  EXPECT_LT(std::chrono::steady_clock::now() - begun, std::chrono::seconds(40));
  EXPECT_TRUE(serves());
}

TEST_F(GrpcHostileTest, ManySilentConnectionsDoNotAffectOthers) {
  std::vector<std::unique_ptr<RawConnection>> silent;
  for (int i = 0; i < 200; ++i) silent.push_back(std::make_unique<RawConnection>(*link_));
  EXPECT_TRUE(serves());
}

}  // namespace
}  // namespace lightwell::test
