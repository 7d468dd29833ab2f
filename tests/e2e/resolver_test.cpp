// A name server that does not answer blocks the lookup of a broker's name for twenty seconds, which must block neither
// the client nor the daemon.
#include <csignal>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <lightwell/time.hpp>

#include "e2e/daemon.hpp"
#include "support/machine.hpp"
#include "support/panorama_file.hpp"

namespace lightwell::test {
namespace {

class ResolverTest : public ::testing::Test {
 protected:
  ResolverTest() {
    write_exr(folder_.path("room.exr"), room_with_lamp_at_plus_x());
    const std::string servers = folder_.write("resolv.conf", "nameserver 127.0.0.1\noptions timeout:10 attempts:2\n");
    Child mount(machine_.inside({"/bin/mount", "--bind", servers, "/etc/resolv.conf"}));
    EXPECT_EQ(mount.wait(), (ExitStatus{0, 0})) << mount.err();
    silent_.emplace(machine_.inside({"/usr/bin/python3", "-c",
                                     "import socket, time\n"
                                     "s = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)\n"
                                     "s.bind(('127.0.0.1', 53))\n"
                                     "print('bound', flush=True)\n"
                                     "time.sleep(600)\n"}));
    EXPECT_TRUE(becomes_true("the name server listens", [&] { return silent_->out() == "bound\n"; })) << silent_->err();
  }

  TempDir folder_;
  Machine machine_{"attic"};
  std::optional<Child> silent_;
  const std::string uri_ = "mqtt://nowhere.example/venue/attic";
};

TEST_F(ResolverTest, TheClientHonoursItsTimeout) {
  const std::int64_t begin = monotonic_now_ns();
  Child watch(machine_.inside(tool_command({"watch", uri_, "--seconds", "1"})));
  EXPECT_EQ(watch.wait(2 * kTestTimeout), (ExitStatus{3, 0})) << watch.err();
  // connect_timeout is two seconds, and ending takes one; the rest allows for a busy machine.
  EXPECT_LT(monotonic_now_ns() - begin, 8'000'000'000);
}

TEST_F(ResolverTest, TheDaemonStopsInTime) {
  DaemonOptions options{.camera = "sim:" + folder_.path("room.exr"), .more = {"--mqtt", uri_}};
  Child daemon(machine_.inside(daemon_command(options)));
  ASSERT_TRUE(becomes_true("the daemon looks up its broker", [&] {
    return occurrences(daemon.err(), "not connected yet") == 1;
  })) << daemon.err();
  const std::int64_t begin = monotonic_now_ns();
  daemon.signal(SIGTERM);
  EXPECT_EQ(daemon.wait(2 * kTestTimeout), (ExitStatus{0, 0})) << daemon.err();
  EXPECT_LT(monotonic_now_ns() - begin, 6'000'000'000);
}

}  // namespace
}  // namespace lightwell::test
