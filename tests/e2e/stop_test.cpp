// How the daemon ends, and what it tells the service manager.
#include <csignal>
#include <cstring>
#include <unistd.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>

#include "e2e/daemon.hpp"
#include "support/panorama_file.hpp"

namespace lightwell::test {
namespace {

using ::testing::HasSubstr;

class StopTest : public ::testing::Test {
 protected:
  StopTest() { write_exr(folder_.path("room.exr"), room_with_lamp_at_plus_x()); }
  [[nodiscard]] std::string camera() const { return "sim:" + folder_.path("room.exr"); }

  TempDir folder_;
};

TEST_F(StopTest, SigtermEndsItWell) {
  Daemon daemon({.camera = camera()});
  (void)daemon.uri();
  EXPECT_EQ(daemon.stop(), (Ending{0, 0})) << daemon.process().err();
}

TEST_F(StopTest, SigintEndsItWell) {
  Daemon daemon({.camera = camera()});
  (void)daemon.uri();
  daemon.process().signal(SIGINT);
  EXPECT_EQ(daemon.process().wait(), (Ending{0, 0}));
}

TEST_F(StopTest, ASignalWhileItIsStillRenderingEndsIt) {
  // More frames than two seconds are enough for.
  Daemon daemon({.camera = camera() + "?turn=1deg/s&ring=2000&sensor=rgb8"});
  Child& child = daemon.process();
  ASSERT_TRUE(
      becomes_true("it says how far the rendering is", [&] { return occurrences(child.err(), "rendering ahead") > 0; }));
  child.signal(SIGTERM);
  EXPECT_EQ(child.wait(), (Ending{0, 0})) << child.err();
  EXPECT_EQ(child.out(), "") << "it never came to listen";
}

TEST_F(StopTest, NeitherAClientNorAStalledOneHoldsItUp) {
  Daemon daemon({.camera = camera(), .frame_rate = 100});
  const Observer observer(daemon.uri());
  Child stalled(tool_command({"watch", daemon.uri()}));
  ASSERT_TRUE(becomes_true("both are clients", [&] { return observer.counters().clients >= 2; }));
  stalled.signal(SIGSTOP);
  ASSERT_TRUE(becomes_true("the stalled one is behind", [&] { return observer.counters().descriptors_coalesced > 0; }));
  EXPECT_EQ(daemon.stop(), (Ending{0, 0})) << daemon.process().err();
  EXPECT_TRUE(becomes_true("the client notices that the probe has gone",
                         [&] { return observer.probe().stats().state != LinkState::connected; }));
  stalled.signal(SIGCONT);
}

TEST_F(StopTest, AClientFindsTheNextDaemonOnTheSamePort) {
  std::optional<Daemon> daemon;
  daemon.emplace(DaemonOptions{.camera = camera()});
  const std::string uri = daemon->uri();
  const Observer observer(uri);
  ASSERT_TRUE(observer.gets(3));
  EXPECT_EQ(daemon->stop(), (Ending{0, 0}));
  const std::string port = uri.substr(std::strlen("grpc://"));
  daemon.emplace(DaemonOptions{.camera = camera(), .listen = port});
  EXPECT_EQ(daemon->uri(), uri);
  EXPECT_TRUE(observer.gets(3));
  EXPECT_GE(observer.probe().stats().reconnects, 1U);
}

/// What systemd listens at.
class ServiceManager {
 public:
  explicit ServiceManager(const std::string& path) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strncpy(address.sun_path, path.c_str(), sizeof address.sun_path - 1);
    EXPECT_EQ(::bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0) << std::strerror(errno);
  }
  ServiceManager(const ServiceManager&) = delete;
  ServiceManager& operator=(const ServiceManager&) = delete;
  ~ServiceManager() { ::close(socket_); }

  /// All that has been said so far.
  [[nodiscard]] const std::string& heard() {
    char buffer[4096];
    for (;;) {
      const ssize_t n = ::recv(socket_, buffer, sizeof buffer, MSG_DONTWAIT);
      if (n <= 0) return heard_;
      heard_ += std::string(buffer, static_cast<std::size_t>(n)) + "\n";
    }
  }

 private:
  int socket_ = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  std::string heard_;
};

TEST_F(StopTest, TheServiceManagerHearsReadyStatusWatchdogAndStopping) {
  const std::string path = folder_.path("notify");
  ServiceManager manager(path);
  Daemon daemon({.camera = camera(), .child = {.environment = {"NOTIFY_SOCKET=" + path}}});
  const std::string uri = daemon.uri();
  ASSERT_TRUE(becomes_true("READY=1 is said", [&] { return manager.heard().find("READY=1") != std::string::npos; }));
  EXPECT_TRUE(Probe::connect(uri).ok()) << "ready means that clients may come";
  EXPECT_TRUE(becomes_true("a status with its counters is said",
                         [&] { return manager.heard().find(" estimates") != std::string::npos; }));
  EXPECT_TRUE(becomes_true("the watchdog is told, and told again",
                         [&] { return occurrences(manager.heard(), "WATCHDOG=1") >= 2; }));
  EXPECT_EQ(occurrences(manager.heard(), "STOPPING=1"), 0U);
  EXPECT_EQ(daemon.stop(), (Ending{0, 0}));
  EXPECT_EQ(occurrences(manager.heard(), "STOPPING=1"), 1U);
  EXPECT_EQ(occurrences(manager.heard(), "READY=1"), 1U);
}

TEST_F(StopTest, UnderTheJournalEveryLineCarriesItsPriority) {
  Daemon daemon({.camera = camera(), .child = {.environment = {"JOURNAL_STREAM=8:1234"}}});
  (void)daemon.uri();
  (void)daemon.stop();
  EXPECT_THAT(daemon.process().err(), HasSubstr("<6>camera sim:"));
}

}  // namespace
}  // namespace lightwell::test
