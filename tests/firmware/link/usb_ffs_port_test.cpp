// The FunctionFS port without a controller: sockets and plain files replace its files; transfers use the kernel's AIO.
#include <array>
#include <cerrno>
#include <fcntl.h>
#include <filesystem>
#include <thread>
#include <unistd.h>

#include <gtest/gtest.h>
#include <linux/usb/functionfs.h>
#include <sys/socket.h>

#include "link/usb_gadget/ffs_port.hpp"
#include "support/read_file.hpp"
#include "support/temp_dir.hpp"

namespace lightwell::test {
namespace {

using Kind = PortEvent::Kind;
constexpr Duration kTimeout{10'000'000'000};

/// Three socket pairs of type SOCK_SEQPACKET, which preserve message boundaries as transfers do.
class FfsPortTest : public ::testing::Test {
 protected:
  void SetUp() override { ASSERT_TRUE(port_->open().ok()); }

  static FileDescriptor make_socket_pair(FileDescriptor& other) {
    std::array<int, 2> ends{};
    EXPECT_EQ(::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0, ends.data()), 0);
    other = FileDescriptor(ends[1]);
    return FileDescriptor(ends[0]);
  }
  void emit(std::initializer_list<int> types) const {
    std::vector<usb_functionfs_event> events;
    for (const int type : types) {
      events.emplace_back();
      events.back().type = static_cast<std::uint8_t>(type);
    }
    const auto bytes = static_cast<ssize_t>(events.size() * sizeof events[0]);
    ASSERT_EQ(::write(control_.get(), events.data(), events.size() * sizeof events[0]), bytes);
  }

  FileDescriptor control_, in_, out_;  ///< The test's ends.
  std::unique_ptr<GadgetPort> port_ = make_ffs_port([this]() -> Result<FfsFiles> {
    FfsFiles files;
    files.control = make_socket_pair(control_);
    files.in = make_socket_pair(in_);
    files.out = make_socket_pair(out_);
    return files;
  });
};

TEST_F(FfsPortTest, ReportsControlEvents) {
  emit({FUNCTIONFS_BIND, FUNCTIONFS_ENABLE, FUNCTIONFS_SUSPEND, FUNCTIONFS_RESUME});
  EXPECT_EQ(port_->wait(kTimeout).kind, Kind::enabled);
  EXPECT_EQ(port_->wait(kTimeout).kind, Kind::suspended);
  EXPECT_EQ(port_->wait(kTimeout).kind, Kind::resumed);
  emit({FUNCTIONFS_DISABLE});
  emit({FUNCTIONFS_UNBIND});
  EXPECT_EQ(port_->wait(kTimeout).kind, Kind::disabled);
  EXPECT_EQ(port_->wait(kTimeout).kind, Kind::disabled);
  EXPECT_EQ(port_->wait({1'000'000}).kind, Kind::timeout);
}

TEST_F(FfsPortTest, CarriesTransfersBothWays) {
  const std::array<std::byte, 5> frame{std::byte{1}, std::byte{2}, std::byte{3}, std::byte{4}, std::byte{5}};
  ASSERT_TRUE(port_->begin_send(frame));
  const PortEvent sent = port_->wait(kTimeout);
  EXPECT_EQ(sent.kind, Kind::sent);
  EXPECT_EQ(sent.bytes, frame.size());
  EXPECT_EQ(sent.error, 0);
  std::array<std::byte, 16> there{};
  ASSERT_EQ(::read(in_.get(), there.data(), there.size()), 5);
  EXPECT_TRUE(std::equal(frame.begin(), frame.end(), there.begin()));

  ASSERT_EQ(::write(out_.get(), "request", 7), 7);
  std::array<std::byte, 64> memory{};
  ASSERT_TRUE(port_->begin_receive(memory));
  const PortEvent received = port_->wait(kTimeout);
  EXPECT_EQ(received.kind, Kind::received);
  EXPECT_EQ(received.bytes, 7U);
  EXPECT_EQ(memory[0], std::byte{'r'});
}

TEST_F(FfsPortTest, AFailedTransferIsAnErrorEvent) {
  std::array<std::byte, 64> memory{};
  // An endpoint that is not enabled gives the same error as an empty socket.
  ASSERT_TRUE(port_->begin_receive(memory));
  const PortEvent event = port_->wait(kTimeout);
  EXPECT_EQ(event.kind, Kind::received);
  EXPECT_EQ(event.error, EAGAIN);
  in_ = FileDescriptor();
  ASSERT_TRUE(port_->begin_send(memory));
  const PortEvent failed = port_->wait(kTimeout);
  EXPECT_EQ(failed.kind, Kind::sent);
  EXPECT_EQ(failed.error, EPIPE);
}

TEST_F(FfsPortTest, WakeEndsTheCurrentOrTheNextWait) {
  port_->wake();
  EXPECT_EQ(port_->wait(kTimeout).kind, Kind::woken);
  std::thread other([this] { port_->wake(); });
  EXPECT_EQ(port_->wait(kTimeout).kind, Kind::woken);
  other.join();
  EXPECT_EQ(port_->wait({1'000'000}).kind, Kind::timeout);
}

TEST_F(FfsPortTest, StallsControlRequestsToTheInterface) {
  usb_functionfs_event event{};
  event.type = FUNCTIONFS_SETUP;
  event.u.setup.bRequestType = USB_DIR_OUT | USB_TYPE_VENDOR | USB_RECIP_INTERFACE;
  ASSERT_EQ(::write(control_.get(), &event, sizeof event), static_cast<ssize_t>(sizeof event));
  EXPECT_EQ(port_->wait({10'000'000}).kind, Kind::timeout) << "control requests are not reported as events";
  std::byte none{};
  EXPECT_EQ(::read(control_.get(), &none, 1), 0) << "an empty write, which makes FunctionFS stall an OUT request";
}

TEST_F(FfsPortTest, CanBeReopened) {
  const auto handles = [] {
    return std::distance(std::filesystem::directory_iterator("/proc/self/fd"), std::filesystem::directory_iterator());
  };
  const auto before = handles();
  for (int i = 0; i < 20; ++i) {
    port_->close();
    ASSERT_TRUE(port_->open().ok());
  }
  EXPECT_EQ(handles(), before);
  emit({FUNCTIONFS_ENABLE});
  EXPECT_EQ(port_->wait(kTimeout).kind, Kind::enabled);
}

TEST(FfsFolder, WritesDescriptorsAndStringsAndOpensEndpoints) {
  TempDir mount;
  for (const char* name : {"ep0", "ep1", "ep2"}) mount.write(name, "");
  const Result<FfsFiles> files = open_ffs(mount.path(""));
  ASSERT_TRUE(files.ok()) << files.status().message();
  const std::vector<std::byte> d = ffs_descriptors(), s = ffs_strings();
  EXPECT_EQ(test::read_file(mount.path("ep0")), std::string(reinterpret_cast<const char*>(d.data()), d.size()) +
                                                    std::string(reinterpret_cast<const char*>(s.data()), s.size()));
}

TEST(FfsFolder, WithoutFunctionFsGivesTheRemedy) {
  const Status nothing = open_ffs("/nonexistent/ffs").status();
  EXPECT_EQ(nothing.code(), StatusCode::not_found);
  EXPECT_NE(nothing.message().find("/nonexistent/ffs/ep0"), std::string::npos) << nothing.message();
  EXPECT_NE(nothing.message().find("lightwell-usb-gadget up"), std::string::npos) << nothing.message();
  TempDir plain;
  plain.write("ep0", "");
  const Status incomplete = open_ffs(plain.path("")).status();
  EXPECT_NE(incomplete.message().find("ep1"), std::string::npos) << incomplete.message();
}

}  // namespace
}  // namespace lightwell::test
