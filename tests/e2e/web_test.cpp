// lightwelld --web with the tool lightwell.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "e2e/secure_daemon.hpp"
#include "firmware/link/raw_web_client.hpp"

namespace lightwell::test {
namespace {

using ::testing::HasSubstr;

class WebTest : public SecureDaemonTest {
 protected:
  /// The web link's address, "ws://127.0.0.1:41235"; waits until the daemon prints it.
  static std::string web_uri(Daemon& daemon) {
    std::string out;
    EXPECT_TRUE(becomes_true("the web link listens", [&] {
      out = daemon.process().out();
      return daemon.process().exit_status() || out.find("listening on ws") != std::string::npos;
    })) << daemon.process().err();
    const std::size_t at = out.find("ws");
    if (at == std::string::npos) return "ws://nothing";
    return out.substr(at, out.find('\n', at) - at);
  }
  [[nodiscard]] DaemonOptions with_web(std::vector<std::string> more) const {
    more.insert(more.end(), {"--web", "127.0.0.1:0"});
    return {.camera = "sim:" + folder_.path("room.exr"), .more = std::move(more)};
  }
};

TEST_F(WebTest, TheToolReceivesLightByWebSocket) {
  Daemon daemon(with_web({}));
  const std::string uri = web_uri(daemon);
  Child watch(tool({"watch", uri, "--seconds", "1"}), environment());
  EXPECT_EQ(watch.wait(), (ExitStatus{0, 0})) << watch.err();
  Child info(tool({"info", uri, "--json"}), environment());
  EXPECT_EQ(info.wait(), (ExitStatus{0, 0})) << info.err();
  EXPECT_THAT(info.out(), HasSubstr("\"name\":\"lightwell\""));
  Child set(tool({"config", "set", uri, "setting=fast"}), environment());
  EXPECT_EQ(set.wait(), (ExitStatus{0, 0})) << set.err();
  const Observer observer(uri);
  EXPECT_TRUE(observer.gets(10));
  EXPECT_TRUE(observer.missing().empty());
  EXPECT_EQ(daemon.stop(), (ExitStatus{0, 0}));
}

TEST_F(WebTest, OnePairingAdmitsAClientToTheWebLink) {
  // The gRPC link is on the loopback in plain text; the web link is for the network.
  Daemon daemon(with_web({"--web-security", "tls", "--keys", keys()}));
  const std::string uri = web_uri(daemon);
  ASSERT_THAT(uri, HasSubstr("wss://"));
  PairingMode mode({"--web", "127.0.0.1:" + std::to_string(port_of(uri)), "--web-security", "tls", "--keys", keys()},
                   0);
  const std::string folder = pair(mode);
  Child watch(tool({"watch", uri, "--seconds", "1"}), environment());
  EXPECT_EQ(watch.wait(), (ExitStatus{0, 0})) << watch.err();
  const Result<Probe> probe = connect(uri, folder);
  ASSERT_TRUE(probe.ok()) << probe.status().message();
  EXPECT_TRUE(gets_light(*probe));
}

TEST_F(WebTest, TheConfigurationFileConfiguresIt) {
  const std::string config = folder_.write("probe.textproto", "camera { uri: \"sim:" + folder_.path("room.exr") +
                                                                  "\" }\nweb { listen_address: \"127.0.0.1:0\" }\n");
  Daemon daemon({.more = {"--config", config}});
  const Observer observer(web_uri(daemon));
  EXPECT_TRUE(observer.gets(3));
}

TEST_F(WebTest, MessagesOfClientsDoNotFillTheLog) {
  Daemon daemon(with_web({}));
  RawWebClient client(port_of(web_uri(daemon)));
  ASSERT_EQ(client.upgrade().status, 101);
  // A LinkRequest `authenticate` (6) whose token (1) is not UTF-8.
  client.send_frame(std::string("\x0d\x01\x00\x00\x00\x32\x03\x0a\x01\xff", 10));
  const std::optional<WebFrame> close = client.close_frame();
  ASSERT_TRUE(close);
  EXPECT_EQ(close->close_code(), 1007);
  EXPECT_THAT(daemon.process().err(), ::testing::Not(HasSubstr("protobuf")));
}

TEST_F(WebTest, PlainTextOnTheNetworkIsRefusedByCheck) {
  Child check(daemon_command({.camera = "sim:" + folder_.path("room.exr"), .more = {"--web", "0.0.0.0:0", "--check"}}));
  EXPECT_EQ(check.wait().code, 1);
  EXPECT_THAT(check.err(), HasSubstr("web.security"));
}

}  // namespace
}  // namespace lightwell::test
