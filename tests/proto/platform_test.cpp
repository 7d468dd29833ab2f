// What proto/src/platform promises on every system. The attacks that only POSIX systems allow are in files_test.cpp.
#include <atomic>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#ifdef _WIN32
#include <winsock2.h>
#include <ws2tcpip.h>
#else
#include <unistd.h>

#include <netinet/in.h>
#include <sys/socket.h>
#endif

#include <lightwell/files.hpp>
#include <lightwell/host_names.hpp>
#include <lightwell/pipe_signal.hpp>
#include <lightwell/socket_wait.hpp>
#include <lightwell/time.hpp>

#include "support/temp_dir.hpp"

namespace lightwell::test {
namespace {

using ::testing::AnyOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

namespace fs = std::filesystem;

std::vector<std::string> names_in(const std::string& folder) {
  std::vector<std::string> out;
  for (const auto& entry : fs::directory_iterator(folder)) out.push_back(text_of(entry.path().filename()));
  return out;
}

class PlatformFiles : public ::testing::Test {
 protected:
  PlatformFiles() { EXPECT_TRUE(make_private_folder(private_).ok()); }
  TempDir folder_;
  const std::string private_ = folder_.path("private"), file_ = private_ + "/token";
};

TEST_F(PlatformFiles, AtomicWriteReplacesTheFileAndLeavesNothingBeside) {
  for (const FileMode mode : {FileMode::owner, FileMode::umask})
    for (const std::string text : {"old", "", "new, and longer"}) {
      const Status s = write_atomically(file_, text, mode);
      ASSERT_TRUE(s.ok()) << s.message();
      EXPECT_EQ(read_private_file(file_).value(), text);
      EXPECT_THAT(names_in(private_), ElementsAre("token"));
    }
}

TEST_F(PlatformFiles, AtomicWriteReplacesNoFolder) {
  fs::create_directory(file_);
  EXPECT_THAT(write_atomically(file_, "x", FileMode::owner).message(), HasSubstr("is not a regular file"));
  EXPECT_THAT(names_in(private_), ElementsAre("token"));
}

TEST_F(PlatformFiles, AtomicWriteNamesTheFileThatCannotBeWritten) {
  const std::string nowhere = folder_.path("none") + "/file";
  EXPECT_THAT(write_atomically(nowhere, "x", FileMode::umask).message(), HasSubstr(nowhere));
}

TEST_F(PlatformFiles, MissingFileIsNoErrorAndAFolderIsOne) {
  EXPECT_EQ(read_named_file(file_).value(), std::nullopt);
  EXPECT_EQ(read_private_file(file_).value(), std::nullopt);
  fs::create_directory(file_);
  EXPECT_EQ(read_named_file(file_).status().code(), StatusCode::failed_precondition);
  EXPECT_EQ(read_private_file(file_).status().code(), StatusCode::failed_precondition);
}

TEST_F(PlatformFiles, PrivateFileHasOneName) {
  ASSERT_TRUE(write_atomically(file_, "secret", FileMode::owner).ok());
  fs::create_hard_link(file_, private_ + "/second");
  EXPECT_THAT(read_private_file(file_).status().message(), HasSubstr("second hard link"));
  EXPECT_THAT(open_for_update(file_).status().message(), HasSubstr("second hard link"));
  EXPECT_EQ(read_named_file(file_).value(), "secret");
}

TEST_F(PlatformFiles, AboveOneMebibyteAreNotRead) {
  ASSERT_TRUE(write_atomically(file_, std::string((1 << 20) + 1, 'x'), FileMode::owner).ok());
  EXPECT_EQ(read_named_file(file_).status().code(), StatusCode::resource_exhausted);
}

TEST_F(PlatformFiles, PathsAreUtf8) {
  const std::string path = private_ + "/Glühlampe ☀ 照明";
  ASSERT_TRUE(write_atomically(path, "light", FileMode::umask).ok());
  EXPECT_THAT(names_in(private_), ElementsAre("Glühlampe ☀ 照明"));
  EXPECT_EQ(read_named_file(path).value(), "light");
  EXPECT_EQ(read_text_file(path).value(), "light");
  EXPECT_TRUE(open_for_update(path).ok());
  EXPECT_TRUE(open_for_reading(path).ok());
}

TEST_F(PlatformFiles, UpdatedFileIsBinaryAndKeepsItsContent) {
  const std::string text("a\r\n\n\x1A z\0", 8);
  {
    const Result<FilePointer> file = open_for_update(file_);
    ASSERT_TRUE(file.ok()) << file.status().message();
    EXPECT_EQ(std::fwrite(text.data(), 1, text.size(), file->get()), text.size());
    EXPECT_EQ(file_position(file->get()), text.size());
  }
  EXPECT_EQ(read_named_file(file_).value(), text);
  const Result<FilePointer> again = open_for_update(file_);
  ASSERT_TRUE(truncate_file(again->get(), 3).ok());
  EXPECT_EQ(file_position(again->get()), 3U);
  EXPECT_EQ(std::fputc('!', again->get()), '!');
  ASSERT_EQ(std::fflush(again->get()), 0);
  EXPECT_EQ(read_named_file(file_).value(), "a\r\n!");
}

TEST_F(PlatformFiles, PositionsAboveTwoGibibytesAreExact) {
  constexpr std::uint64_t kSize = (std::uint64_t{5} << 30) + 7;
  ASSERT_TRUE(write_atomically(file_, "", FileMode::owner).ok());
  const Result<FilePointer> file = open_for_update(file_);
  ASSERT_TRUE(file.ok()) << file.status().message();
  const Status s = truncate_file(file->get(), kSize);
  ASSERT_TRUE(s.ok()) << s.message();
  EXPECT_EQ(file_position(file->get()), kSize);
  const Result<FilePointer> read = open_for_reading(file_);
  ASSERT_TRUE(read.ok()) << read.status().message();
  ASSERT_EQ(std::fseek(read->get(), 0, SEEK_END), 0);
  EXPECT_EQ(file_position(read->get()), kSize);
}

TEST_F(PlatformFiles, MissingFileIsNotOpenedForReading) {
  const Status s = open_for_reading(file_).status();
  EXPECT_EQ(s.code(), StatusCode::not_found);
  EXPECT_THAT(s.message(), HasSubstr(file_));
}

TEST_F(PlatformFiles, PrivateFolderIsMadeWithItsParentsAndIsNoFile) {
  const std::string deep = private_ + "/a/b";
  EXPECT_TRUE(make_private_folder(deep).ok());
  EXPECT_TRUE(fs::is_directory(deep));
  EXPECT_TRUE(make_private_folder(deep).ok()) << "it is there already";
  EXPECT_THAT(make_private_folder(folder_.write("file", "x")).message(), HasSubstr("is not a folder"));
}

TEST_F(PlatformFiles, FolderIsReplacedWithoutRemains) {
  const std::string folder = private_ + "/probe";
  for (const char* text : {"old", "new"}) {
    const Result<std::string> made = make_folder_beside(folder);
    ASSERT_TRUE(made.ok()) << made.status().message();
    ASSERT_TRUE(write_atomically(*made + "/token", text, FileMode::owner).ok());
    const Status s = replace_folder(*made, folder);
    ASSERT_TRUE(s.ok()) << s.message();
    EXPECT_EQ(read_private_file(folder + "/token").value(), text);
    EXPECT_THAT(names_in(private_), ElementsAre("probe"));
  }
}

TEST_F(PlatformFiles, FolderLockExcludesOthersUntilItIsReleased) {
  std::optional<Result<FolderLock>> first(FolderLock::take(private_));
  ASSERT_TRUE(first->ok()) << first->status().message();
  std::atomic<bool> released{false}, taken_after{false};
  std::thread other([&] {
    const Result<FolderLock> second = FolderLock::take(private_);
    taken_after = second.ok() && released;
  });
  // Long enough for a lock that excludes nobody to be taken.
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  released = true;
  first.reset();
  other.join();
  EXPECT_TRUE(taken_after);
}

TEST(PlatformFolders, ConfigurationFolderIsAbsolute) {
  EXPECT_TRUE(fs::path(configuration_folder()).is_absolute()) << configuration_folder();
}

TEST(PlatformErrors, FullDiskIsToldFromOthers) {
  EXPECT_TRUE(is_disk_full(ENOSPC));
  EXPECT_TRUE(is_disk_full(EFBIG));
  EXPECT_FALSE(is_disk_full(EACCES));
  EXPECT_FALSE(is_disk_full(0));
}

TEST(HostNames, NumericAddressesAreThemselves) {
  EXPECT_THAT(numeric_addresses("127.0.0.1", HostForm::numeric), ElementsAre("127.0.0.1"));
  EXPECT_THAT(numeric_addresses("::1", HostForm::numeric), ElementsAre("::1"));
  EXPECT_THAT(numeric_addresses("127.0.0.1", HostForm::any), Contains("127.0.0.1"));
}

TEST(HostNames, NamesAreResolvedIfThatIsWanted) {
  EXPECT_THAT(numeric_addresses("localhost", HostForm::numeric), IsEmpty());
  EXPECT_THAT(numeric_addresses("localhost", HostForm::any), Contains(AnyOf("127.0.0.1", "::1")));
  EXPECT_THAT(numeric_addresses("no such host", HostForm::any), IsEmpty());
}

TEST(HostNames, ThisMachineHasAName) { EXPECT_THAT(host_name(), Not(IsEmpty())); }

TEST(HostNames, UnknownInterfaceHasNoName) { EXPECT_EQ(interface_name(4'000'000'000U), ""); }

TEST(PipeSignal, FunctionIsCalledOnce) {
  int calls = 0;
  block_pipe_signal();
  keep_pipe_signal([&calls] { ++calls; });
  EXPECT_EQ(calls, 1);
}

constexpr Duration kLong{60'000'000'000}, kShort{50'000'000};

TEST(SocketWait, TimesOut) {
  SocketWait wait;
  const std::int64_t begin = monotonic_now_ns();
  const SocketEvents events = wait.wait(-1, {}, kShort);
  EXPECT_GE(monotonic_now_ns() - begin, kShort.ns);
  EXPECT_FALSE(events.readable || events.writable || events.failed);
}

TEST(SocketWait, IsWokenByAnotherThread) {
  SocketWait wait;
  const std::int64_t begin = monotonic_now_ns();
  std::thread other([&wait] {
    std::this_thread::sleep_for(std::chrono::nanoseconds(kShort.ns));
    wait.wake();
  });
  (void)wait.wait(-1, {}, kLong);
  EXPECT_LT(monotonic_now_ns() - begin, kLong.ns / 2);
  other.join();
}

TEST(SocketWait, WakesBeforeTheWaitCountOnce) {
  SocketWait wait;
  wait.wake();
  wait.wake();
  std::int64_t begin = monotonic_now_ns();
  (void)wait.wait(-1, {}, kLong);
  EXPECT_LT(monotonic_now_ns() - begin, kLong.ns / 2);
  begin = monotonic_now_ns();
  (void)wait.wait(-1, {}, kShort);
  EXPECT_GE(monotonic_now_ns() - begin, kShort.ns) << "the wakes were taken by the first wait";
}

/// A datagram socket of the loopback address that is connected to itself.
class Loopback {
 public:
  Loopback() {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    auto* const at = reinterpret_cast<sockaddr*>(&address);
    socklen_t size = sizeof address;
    number_ = static_cast<int>(::socket(AF_INET, SOCK_DGRAM, 0));
    if (::bind(number_, at, size) != 0 || ::getsockname(number_, at, &size) != 0 || ::connect(number_, at, size) != 0)
      ADD_FAILURE() << "no socket";
  }
  Loopback(const Loopback&) = delete;
  Loopback& operator=(const Loopback&) = delete;
  ~Loopback() {
#ifdef _WIN32
    ::closesocket(static_cast<SOCKET>(number_));
#else
    ::close(number_);
#endif
  }
  [[nodiscard]] int number() const { return number_; }
  void send() const { EXPECT_EQ(::send(number_, "x", 1, 0), 1); }

 private:
  int number_ = -1;
};

TEST(SocketWait, ReportsWhatASocketIsReadyFor) {
  SocketWait wait;  // Before the socket: on Windows it starts Winsock.
  const Loopback socket;
  const SocketEvents writable = wait.wait(socket.number(), {.writable = true}, kLong);
  EXPECT_TRUE(writable.writable);
  EXPECT_FALSE(writable.readable || writable.failed);
  EXPECT_FALSE(wait.wait(socket.number(), {}, kShort).readable);
  socket.send();
  const SocketEvents readable = wait.wait(socket.number(), {}, kLong);
  EXPECT_TRUE(readable.readable);
  EXPECT_FALSE(readable.writable) << "not asked for";
  EXPECT_EQ(take_socket_error(socket.number()), "");
}

TEST(SocketWait, WakesAWaitForASocket) {
  SocketWait wait;
  const Loopback socket;
  wait.wake();
  EXPECT_FALSE(wait.wait(socket.number(), {}, kLong).readable);
}

TEST(SocketWait, SendBufferHasTheSizeThatWasSet) {
  SocketWait wait;
  const Loopback socket;
  set_send_buffer(socket.number(), 20'000);
  int bytes = 0;
  socklen_t size = sizeof bytes;
  ASSERT_EQ(::getsockopt(socket.number(), SOL_SOCKET, SO_SNDBUF, reinterpret_cast<char*>(&bytes), &size), 0);
  // Linux doubles the number.
  EXPECT_THAT(bytes, AnyOf(20'000, 40'000));
}

}  // namespace
}  // namespace lightwell::test
