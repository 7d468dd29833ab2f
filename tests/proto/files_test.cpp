// Files in folders of another user. If the test runs as root, the folder belongs to another user, as the daemon's does
// when an administrator runs `lightwelld --pair`.
#include <fcntl.h>
#include <filesystem>
#include <fstream>
#include <unistd.h>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <lightwell/files.hpp>

#include "support/hostile_file.hpp"
#include "support/temp_dir.hpp"

namespace lightwell::test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr uid_t kDaemon = 4711;

bool is_root() { return ::geteuid() == 0; }

struct stat facts_of(const std::string& path) {
  struct stat s {};
  EXPECT_EQ(::lstat(path.c_str(), &s), 0) << path;
  return s;
}

void give_away(const std::string& path) {
  if (is_root()) {
    ASSERT_EQ(::lchown(path.c_str(), kDaemon, kDaemon), 0) << path;
  }
}

class Files : public ::testing::Test {
 protected:
  Files() {
    EXPECT_TRUE(make_private_folder(keys_).ok());
    give_away(keys_);
  }
  TempDir folder_;
  HostileFile trap_;
  const std::string keys_ = folder_.path("keys"), file_ = keys_ + "/token";
};

TEST_F(Files, AreAccessibleToTheFoldersOwnerOnly) {
  ASSERT_TRUE(write_atomically(file_, "secret", FileMode::owner).ok());
  ASSERT_TRUE(FolderLock::take(keys_).ok());
  for (const std::string& path : {file_, keys_ + "/lock"}) {
    EXPECT_EQ(facts_of(path).st_uid, facts_of(keys_).st_uid) << path;
    EXPECT_EQ(facts_of(path).st_mode & 0777, 0600U) << path;
  }
  EXPECT_TRUE(FolderLock::take(keys_).ok()) << "the second time it is the owner's file";
  EXPECT_EQ(read_private_file(file_).value(), "secret");
}

TEST_F(Files, UmaskModeRespectsTheUmask) {
  const mode_t before = ::umask(027);
  const Status s = write_atomically(file_, "light", FileMode::umask);
  ::umask(before);
  ASSERT_TRUE(s.ok()) << s.message();
  EXPECT_EQ(facts_of(file_).st_mode & 0777, 0640U);
}

TEST_F(Files, LockRefusesHostileFilesAndChangesNoOwner) {
  for (const HostileFileKind kind : kHostileFileKinds) {
    const std::string lock = keys_ + "/lock";
    trap_.set(kind, lock);
    // A hard link has the owner of its target.
    if (kind != HostileFileKind::hard_link) give_away(lock);
    const Result<FolderLock> taken = FolderLock::take(keys_);
    EXPECT_THAT(taken.status().message(), HasSubstr(lock)) << to_string(kind);
    trap_.expect_untouched(lock, to_string(kind));
    std::filesystem::remove(lock);
  }
}

TEST_F(Files, HostileFilesAreNotRead) {
  for (const HostileFileKind kind : kHostileFileKinds) {
    trap_.set(kind, file_);
    EXPECT_THAT(read_private_file(file_).status().message(), HasSubstr(file_)) << to_string(kind);
    std::filesystem::remove(file_);
  }
  EXPECT_EQ(read_private_file(file_).value(), std::nullopt) << "a missing file is not an error";
}

TEST_F(Files, RecordingIsNotWrittenThroughHostileFiles) {
  for (const HostileFileKind kind : {HostileFileKind::hard_link, HostileFileKind::fifo, HostileFileKind::folder}) {
    trap_.set(kind, file_);
    EXPECT_THAT(open_for_update(file_).status().message(), HasSubstr(file_)) << to_string(kind);
    trap_.expect_untouched(file_, to_string(kind));
    std::filesystem::remove(file_);
  }
  EXPECT_TRUE(open_for_update("/dev/null").ok());
}

TEST_F(Files, AtomicWriteReplacesNoHostileFileExceptAHardLink) {
  for (const HostileFileKind kind : {HostileFileKind::fifo, HostileFileKind::folder}) {
    trap_.set(kind, file_);
    EXPECT_THAT(write_atomically(file_, "x", FileMode::owner).message(), HasSubstr(file_)) << to_string(kind);
    trap_.expect_untouched(file_, to_string(kind));
    std::filesystem::remove(file_);
  }
  trap_.set(HostileFileKind::hard_link, file_);
  EXPECT_TRUE(write_atomically(file_, "x", FileMode::owner).ok());
  trap_.expect_untouched(file_, "hard link");
  EXPECT_EQ(read_private_file(file_).value(), "x");
  // A device is written directly; a rename as root would replace it by a file.
  EXPECT_TRUE(write_atomically("/dev/null", "x", FileMode::umask).ok());
  EXPECT_TRUE(S_ISCHR(facts_of("/dev/null").st_mode));
}

/// Root does not follow symbolic links of the daemon's user; links of root or of the same user are followed.
TEST_F(Files, SymbolicLinkIsFollowedIfItsOwnerIsTrusted) {
  const std::string elsewhere = folder_.path("elsewhere"), link = keys_ + "/link";
  ASSERT_TRUE(make_private_folder(elsewhere).ok());
  std::filesystem::create_directory_symlink(elsewhere, link);
  EXPECT_TRUE(write_atomically(link + "/a", "x", FileMode::owner).ok());
  EXPECT_EQ(read_named_file(link + "/a").value(), "x");
  std::filesystem::create_symlink(elsewhere + "/a", file_);
  EXPECT_EQ(read_named_file(file_).value(), "x");
  if (!is_root()) return;
  give_away(link);
  give_away(file_);
  for (const Status& s : {write_atomically(link + "/a", "y", FileMode::owner), read_named_file(link + "/a").status(),
                          open_for_update(link + "/b").status(), make_private_folder(link + "/c"),
                          FolderLock::take(link).status(), read_named_file(file_).status(),
                          write_atomically(file_, "y", FileMode::umask), open_for_update(file_).status()})
    EXPECT_THAT(s.message(), HasSubstr("another user made"));
  EXPECT_EQ(read_named_file(elsewhere + "/a").value(), "x");
  EXPECT_FALSE(std::filesystem::exists(elsewhere + "/lock"));
}

TEST_F(Files, FolderThatIsALinkAFileOrForeignIsRefused) {
  std::filesystem::create_directory_symlink(keys_, folder_.path("link"));
  EXPECT_THAT(make_private_folder(folder_.path("link")).message(), AllOf(HasSubstr("link"), HasSubstr("not a folder")));
  EXPECT_THAT(make_private_folder(folder_.write("file", "x")).message(), HasSubstr("not a folder"));
  EXPECT_TRUE(make_private_folder(keys_ + "/new/keys").ok());
  EXPECT_EQ(facts_of(keys_ + "/new/keys").st_mode & 0777, 0700U);
}

TEST_F(Files, FolderIsReplacedAtomicallyWithoutRemains) {
  const std::string folder = folder_.path("store/probe");
  std::filesystem::create_directory(folder_.path("store"));
  for (const char* text : {"old", "new"}) {
    const Result<std::string> made = make_folder_beside(folder);
    ASSERT_TRUE(made.ok()) << made.status().message();
    ASSERT_TRUE(write_atomically(*made + "/token", text, FileMode::owner).ok());
    ASSERT_TRUE(replace_folder(*made, folder).ok());
    EXPECT_EQ(read_private_file(folder + "/token").value(), text);
  }
  std::size_t entries = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder_.path("store"))) {
    EXPECT_EQ(entry.path(), folder);
    ++entries;
  }
  EXPECT_EQ(entries, 1U);
}

TEST_F(Files, AboveOneMebibyteAreNotRead) {
  ASSERT_TRUE(write_atomically(file_, std::string((1 << 20) + 1, 'x'), FileMode::owner).ok());
  EXPECT_EQ(read_private_file(file_).status().code(), StatusCode::resource_exhausted);
}

TEST(ReadTextFile, ReadsAWholeFileAndNamesThePathInErrors) {
  const TempDir folder;
  const std::string text = std::string(20'000, 'x') + '\0' + "end";
  EXPECT_EQ(read_text_file(folder.write("text", text)).value(), text);
  EXPECT_EQ(read_text_file(folder.write("empty", "")).value(), "");
  const Status none = read_text_file(folder.path("none")).status();
  EXPECT_EQ(none.code(), StatusCode::not_found);
  EXPECT_THAT(none.message(), HasSubstr(folder.path("none") + ": cannot be opened"));
  EXPECT_EQ(read_text_file(folder.path("")).status().code(), StatusCode::data_loss) << "a folder";
}

TEST(OwnedDescriptor, IsClosedOnceByItsLastOwner) {
  int ends[2];
  ASSERT_EQ(::pipe(ends), 0);
  const auto is_open = [](int number) { return ::fcntl(number, F_GETFD) != -1; };
  {
    FileDescriptor one(ends[0]), other(ends[1]);
    FileDescriptor moved(std::move(one));
    EXPECT_FALSE(one);  // NOLINT(bugprone-use-after-move): moving leaves no descriptor behind.
    EXPECT_EQ(moved.get(), ends[0]);
    other = FileDescriptor();
    EXPECT_FALSE(is_open(ends[1])) << "a replaced descriptor is closed";
    EXPECT_TRUE(is_open(ends[0]));
  }
  EXPECT_FALSE(is_open(ends[0]));
  EXPECT_EQ(FileDescriptor(17).release(), 17);
}

}  // namespace
}  // namespace lightwell::test
