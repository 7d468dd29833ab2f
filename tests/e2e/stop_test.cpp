// Shutdown of the daemon, and its notifications to the service manager.
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

TEST_F(StopTest, SigtermEndsTheDaemonCleanly) {
  Daemon daemon({.camera = camera()});
  (void)daemon.uri();
  EXPECT_EQ(daemon.stop(), (ExitStatus{0, 0})) << daemon.process().err();
}

TEST_F(StopTest, SigintEndsTheDaemonCleanly) {
  Daemon daemon({.camera = camera()});
  (void)daemon.uri();
  daemon.process().signal(SIGINT);
  EXPECT_EQ(daemon.process().wait(), (ExitStatus{0, 0}));
}

TEST_F(StopTest, ASignalWhileItIsStillRenderingEndsIt) {
  // More frames than can be rendered in two seconds.
  Daemon daemon({.camera = camera() + "?yaw_rate=1deg/s&frames=2000&sensor=rgb8"});
  Child& child = daemon.process();
  ASSERT_TRUE(becomes_true("the progress of rendering is printed",
                           [&] { return occurrences(child.err(), "rendering ahead") > 0; }));
  child.signal(SIGTERM);
  EXPECT_EQ(child.wait(), (ExitStatus{0, 0})) << child.err();
  EXPECT_EQ(child.out(), "") << "it must not listen yet";
}

TEST_F(StopTest, NeitherAClientNorAStalledOneDelaysTheEnd) {
  Daemon daemon({.camera = camera(), .frame_rate = 100});
  const Observer observer(daemon.uri());
  Child stalled(tool_command({"watch", daemon.uri()}));
  ASSERT_TRUE(becomes_true("both are clients", [&] { return observer.counters().clients >= 2; }));
  stalled.signal(SIGSTOP);
  ASSERT_TRUE(becomes_true("descriptors for the stalled client are coalesced",
                           [&] { return observer.counters().descriptors_coalesced > 0; }));
  EXPECT_EQ(daemon.stop(), (ExitStatus{0, 0})) << daemon.process().err();
  EXPECT_TRUE(becomes_true("the client notices that the probe has gone",
                           [&] { return observer.probe().stats().state != LinkState::connected; }));
  stalled.signal(SIGCONT);
}

TEST_F(StopTest, AClientReconnectsToTheNextDaemonOnTheSamePort) {
  std::optional<Daemon> daemon;
  daemon.emplace(DaemonOptions{.camera = camera()});
  const std::string uri = daemon->uri();
  const Observer observer(uri);
  ASSERT_TRUE(observer.gets(3));
  EXPECT_EQ(daemon->stop(), (ExitStatus{0, 0}));
  const std::string port = uri.substr(std::strlen("grpc://"));
  daemon.emplace(DaemonOptions{.camera = camera(), .listen = port});
  EXPECT_EQ(daemon->uri(), uri);
  EXPECT_TRUE(observer.gets(3));
  EXPECT_GE(observer.probe().stats().reconnects, 1U);
}

/// The notification socket of systemd.
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

  /// All notifications received so far.
  [[nodiscard]] const std::string& received() {
    char buffer[4096];
    for (;;) {
      const ssize_t n = ::recv(socket_, buffer, sizeof buffer, MSG_DONTWAIT);
      if (n <= 0) return received_;
      received_ += std::string(buffer, static_cast<std::size_t>(n)) + "\n";
    }
  }

 private:
  int socket_ = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  std::string received_;
};

TEST_F(StopTest, NotifiesReadyStatusWatchdogAndStopping) {
  const std::string path = folder_.path("notify");
  ServiceManager manager(path);
  Daemon daemon({.camera = camera(), .child = {.environment = {"NOTIFY_SOCKET=" + path}}});
  const std::string uri = daemon.uri();
  ASSERT_TRUE(becomes_true("READY=1 is sent", [&] { return manager.received().find("READY=1") != std::string::npos; }));
  EXPECT_TRUE(Probe::connect(uri).ok()) << "clients must be accepted after READY=1";
  EXPECT_TRUE(becomes_true("a status with counters is sent",
                           [&] { return manager.received().find(" estimates") != std::string::npos; }));
  EXPECT_TRUE(becomes_true("the watchdog is notified twice",
                           [&] { return occurrences(manager.received(), "WATCHDOG=1") >= 2; }));
  EXPECT_EQ(occurrences(manager.received(), "STOPPING=1"), 0U);
  EXPECT_EQ(daemon.stop(), (ExitStatus{0, 0}));
  EXPECT_EQ(occurrences(manager.received(), "STOPPING=1"), 1U);
  EXPECT_EQ(occurrences(manager.received(), "READY=1"), 1U);
}

TEST_F(StopTest, UnderTheJournalEveryLineCarriesItsPriority) {
  Daemon daemon({.camera = camera(), .child = {.environment = {"JOURNAL_STREAM=8:1234"}}});
  (void)daemon.uri();
  (void)daemon.stop();
  EXPECT_THAT(daemon.process().err(), HasSubstr("<6>camera sim:"));
}

}  // namespace
}  // namespace lightwell::test
