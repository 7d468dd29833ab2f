// load_probe_keys(), ReloadingKeys and ClientList on files.
#include <ctime>
#include <filesystem>
#include <fstream>
#include <thread>
#include <unistd.h>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <lightwell/files.hpp>
#include <lightwell/secrets.hpp>

#include "link/access/client_list.hpp"
#include "link/access/probe_keys.hpp"
#include "support/hostile_file.hpp"
#include "support/temp_dir.hpp"

namespace lightwell::test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr std::int64_t kNow = 1'800'000'000;
constexpr std::int64_t kYear = 365 * 86'400;

mode_t mode_of(const std::string& path) {
  struct stat s {};
  EXPECT_EQ(::stat(path.c_str(), &s), 0) << path;
  return s.st_mode & 0777;
}

class ProbeKeysTest : public ::testing::Test {
 protected:
  ProbeKeysTest() { config_.key_folder = folder_.path("keys"); }
  [[nodiscard]] ProbeKeys load(std::int64_t now = kNow) const {
    const Result<ProbeKeys> keys = load_probe_keys(config_, "attic", now);
    EXPECT_TRUE(keys.ok()) << keys.status().message();
    return keys.ok() ? *keys : ProbeKeys();
  }
  std::string load_error() const {
    const Result<ProbeKeys> keys = load_probe_keys(config_, "attic", kNow);
    EXPECT_FALSE(keys.ok());
    return keys.status().message();
  }
  TempDir folder_;
  GrpcConfig config_{.security = LinkSecurity::tls};
};

TEST_F(ProbeKeysTest, AreCreatedOnceAndKept) {
  const ProbeKeys first = load(), again = load(kNow + 86'400);
  EXPECT_EQ(first.certificate, again.certificate);
  EXPECT_EQ(first.key, again.key);
  EXPECT_EQ(first.trust, again.trust);
  EXPECT_TRUE(check_key_matches_certificate(first.certificate, first.key).ok());
}

TEST_F(ProbeKeysTest, AreReadableByTheirOwnerOnly) {
  (void)load();
  EXPECT_EQ(mode_of(config_.key_folder), 0700U);
  for (const auto& entry : std::filesystem::directory_iterator(config_.key_folder))
    EXPECT_EQ(mode_of(entry.path().string()), 0600U) << entry.path();
}

TEST_F(ProbeKeysTest, RejectsAFolderThatIsWritableByOthers) {
  std::filesystem::create_directory(config_.key_folder);
  ASSERT_EQ(::chmod(config_.key_folder.c_str(), 0777), 0);
  EXPECT_THAT(load_error(), AllOf(HasSubstr(config_.key_folder), HasSubstr("chmod 700")));
}

/// The folder belongs to the daemon's user, but `lightwelld --pair` accesses it as root.
TEST_F(ProbeKeysTest, RejectsHostileFilesAndDoesNotModifyThem) {
  (void)load();
  const HostileFile trap;
  for (const char* name : {"lock", "ca.pem", "ca_key.pem", "probe.pem", "probe_key.pem"}) {
    const std::string path = config_.key_folder + "/" + name, aside = folder_.path("aside");
    for (const HostileFileKind kind : kHostileFileKinds) {
      std::filesystem::rename(path, aside);
      trap.set(kind, path);
      EXPECT_THAT(load_error(), HasSubstr(path)) << to_string(kind);
      trap.expect_untouched(path, to_string(kind));
      std::filesystem::remove(path);
      std::filesystem::rename(aside, path);
    }
  }
  EXPECT_FALSE(load().key.empty());
}

TEST_F(ProbeKeysTest, RejectsAFolderThatIsASymbolicLink) {
  (void)load();
  std::filesystem::create_directory_symlink(config_.key_folder, folder_.path("link"));
  config_.key_folder = folder_.path("link");
  EXPECT_THAT(load_error(), AllOf(HasSubstr(config_.key_folder), HasSubstr("symbolic link")));
}

TEST_F(ProbeKeysTest, ConcurrentFirstLoadsGiveTheSameKeys) {
  std::vector<std::string> certificates(8);
  {
    std::vector<std::jthread> crowd;
    for (std::string& one : certificates) crowd.emplace_back([&one, this] { one = load().certificate; });
  }
  EXPECT_THAT(certificates, ::testing::Each(certificates.front()));
}

TEST_F(ProbeKeysTest, RenewsTheCertificateButNotThePinnedAuthority) {
  const ProbeKeys first = load();
  EXPECT_EQ(load(kNow + kYear).certificate, first.certificate);
  const ProbeKeys later = load(kNow + 3 * kYear / 2);
  EXPECT_NE(later.certificate, first.certificate);
  EXPECT_GE(identify_certificate(later.certificate)->expires_s, kNow + 3 * kYear);
  EXPECT_EQ(later.trust, first.trust);
  EXPECT_EQ(later.key, first.key);
}

TEST_F(ProbeKeysTest, KeysCreatedWithAClockOf1970AreValidLongEnough) {
  EXPECT_GE(identify_certificate(load(100).certificate)->expires_s, kDefaultNotBefore_s + kYear);
}

TEST_F(ProbeKeysTest, ErrorsNameTheBrokenFile) {
  (void)load();
  for (const char* file : {"ca.pem", "ca_key.pem", "probe.pem", "probe_key.pem"}) {
    const std::string path = config_.key_folder + "/" + file, good = *read_private_file(path).value();
    for (const std::string& bad : {std::string(), std::string("garbage"), good.substr(0, good.size() / 2)}) {
      ASSERT_TRUE(write_atomically(path, bad, FileMode::owner).ok());
      EXPECT_THAT(load_error(), HasSubstr(file));
    }
    ASSERT_TRUE(write_atomically(path, good, FileMode::owner).ok());
  }
  const std::string other = KeyPair::make()->private_pem;
  ASSERT_TRUE(write_atomically(config_.key_folder + "/probe_key.pem", other, FileMode::owner).ok());
  EXPECT_THAT(load_error(), AllOf(HasSubstr("probe.pem"), HasSubstr("does not belong to the certificate")));
}

TEST_F(ProbeKeysTest, OwnerFilesReplaceTheProbesAndMustMatch) {
  GrpcConfig other;
  other.key_folder = folder_.path("other");
  const ProbeKeys owners = *load_probe_keys(other, "cellar", kNow);
  config_.certificate = folder_.write("own.pem", owners.certificate);
  config_.key = folder_.write("own_key.pem", owners.key);
  EXPECT_EQ(load().certificate, owners.certificate);
  EXPECT_EQ(load().trust, owners.certificate) << "clients pin the probe's certificate";
  folder_.write("own.pem", owners.certificate + owners.trust);
  EXPECT_EQ(load().certificate, owners.certificate + owners.trust);
  EXPECT_EQ(load().trust, owners.certificate) << "only the first certificate: the others also sign for other servers";
  config_.client_ca = folder_.write("clients.pem", owners.trust);
  EXPECT_FALSE(load().issues_client_certificates()) << "the owner's authority issues the client certificates";
  config_.key = folder_.write("own_key.pem", KeyPair::make()->private_pem);
  EXPECT_THAT(load_error(),
              AllOf(HasSubstr("own.pem"), HasSubstr("own_key.pem"), HasSubstr("does not belong to the certificate")));
  config_.key = folder_.path("nowhere.pem");
  EXPECT_THAT(load_error(), AllOf(HasSubstr("nowhere.pem"), HasSubstr("grpc.key")));
}

TEST_F(ProbeKeysTest, DoesNotWriteThroughAHostileClientList) {
  const ProbeKeys keys = load();
  const std::string public_key = public_key_of(keys.key).value();
  const HostileFile trap;
  for (const HostileFileKind kind : kHostileFileKinds) {
    trap.set(kind, keys.client_list);
    const Result<ClientCredentials> client = register_client(keys, "ann", public_key, 1, kNow);
    EXPECT_THAT(client.status().message(), HasSubstr(keys.client_list)) << to_string(kind);
    trap.expect_untouched(keys.client_list, to_string(kind));
    std::filesystem::remove(keys.client_list);
  }
  EXPECT_TRUE(register_client(keys, "ann", public_key, 1, kNow).ok());
}

class ReloadingKeysTest : public ProbeKeysTest {
 protected:
  std::int64_t now_s_ = kNow;
  ReloadingKeys reloading_{config_, "attic", [this] { return now_s_; }};
};

TEST_F(ReloadingKeysTest, KeepTheInitialKeysUntilRenewal) {
  const Result<ProbeKeys> first = reloading_.load();
  ASSERT_TRUE(first.ok()) << first.status().message();
  EXPECT_EQ(reloading_.take_changed()->certificate, first->certificate) << "the first call returns the keys";
  now_s_ += kYear;
  EXPECT_FALSE(reloading_.take_changed());
  now_s_ += kYear / 2;
  const std::optional<ProbeKeys> renewed = reloading_.take_changed();
  ASSERT_TRUE(renewed);
  EXPECT_GE(identify_certificate(renewed->certificate)->expires_s, kNow + 3 * kYear);
  EXPECT_EQ(renewed->key, first->key);
  EXPECT_EQ(renewed->trust, first->trust);
  EXPECT_EQ(**read_private_file(config_.key_folder + "/probe.pem"), renewed->certificate);
  EXPECT_FALSE(reloading_.take_changed());
  EXPECT_EQ(reloading_.error_message(), "");
}

TEST_F(ReloadingKeysTest, AFailedRenewalIsReportedAndThePreviousKeysStay) {
  ASSERT_TRUE(reloading_.load().ok());
  (void)reloading_.take_changed();
  const std::string good = **read_private_file(config_.key_folder + "/probe_key.pem");
  ASSERT_TRUE(write_atomically(config_.key_folder + "/probe_key.pem", "garbage", FileMode::owner).ok());
  EXPECT_EQ(reloading_.error_message(), "") << "the files are checked once a minute";
  now_s_ += 3 * kYear / 2;
  EXPECT_THAT(reloading_.error_message(), AllOf(HasSubstr("probe_key.pem"), HasSubstr("the previous keys are used")));
  EXPECT_FALSE(reloading_.take_changed());
  ASSERT_TRUE(write_atomically(config_.key_folder + "/probe_key.pem", good, FileMode::owner).ok());
  now_s_ += 60;
  EXPECT_TRUE(reloading_.take_changed()) << "repaired, the certificate is renewed";
  EXPECT_EQ(reloading_.error_message(), "");
}

TEST_F(ReloadingKeysTest, ADeletedAuthorityIsReportedAndNotReplaced) {
  ASSERT_TRUE(reloading_.load().ok());
  (void)reloading_.take_changed();
  std::filesystem::remove_all(config_.key_folder);
  now_s_ += 2 * kYear;
  EXPECT_THAT(reloading_.error_message(),
              AllOf(HasSubstr(config_.key_folder + "/ca_key.pem"), HasSubstr("pair its clients again")));
  EXPECT_FALSE(reloading_.take_changed());
  EXPECT_FALSE(std::filesystem::exists(config_.key_folder));
}

TEST_F(ReloadingKeysTest, ReloadsOwnerFilesWhenTheyChangeAndMatch) {
  const auto owners = [&](const char* folder) {
    GrpcConfig other;
    other.key_folder = folder_.path(folder);
    return *load_probe_keys(other, folder, kNow);
  };
  const ProbeKeys one = owners("one"), other = owners("other");
  config_.certificate = folder_.write("own.pem", one.certificate);
  config_.key = folder_.write("own_key.pem", one.key);
  ReloadingKeys reloading(config_, "attic", [this] { return now_s_; });
  ASSERT_TRUE(reloading.load().ok());
  EXPECT_EQ(reloading.take_changed()->certificate, one.certificate);
  folder_.write("own.pem", other.certificate);
  now_s_ += 60;
  EXPECT_FALSE(reloading.take_changed()) << "a certificate without its key is not accepted";
  EXPECT_THAT(reloading.error_message(), HasSubstr("own.pem"));
  folder_.write("own_key.pem", other.key);
  now_s_ += 60;
  const std::optional<ProbeKeys> changed = reloading.take_changed();
  ASSERT_TRUE(changed);
  EXPECT_EQ(changed->certificate, other.certificate);
  EXPECT_EQ(changed->key, other.key);
  EXPECT_EQ(reloading.error_message(), "");
}

class ClientListTest : public ::testing::Test {
 protected:
  static constexpr const char* kToken = "0123456789012345678901234567890123456789abc";
  void add(const std::string& token, std::int64_t expires, const std::string& certificate = {}) const {
    ASSERT_TRUE(ClientList::add(path_, {to_hex(sha256(token)), certificate, expires, "x"}, kNow).ok());
  }
  TempDir folder_;
  const std::string path_ = folder_.path("clients");
  ClientList list_{path_};
};

TEST_F(ClientListTest, AcceptsListedClientsUntilTheyExpire) {
  EXPECT_FALSE(list_.accepts_token(kToken, kNow)) << "a missing file is an empty list";
  add(kToken, kNow + 10, std::string(64, 'c'));
  EXPECT_TRUE(list_.accepts_token(kToken, kNow));
  EXPECT_TRUE(list_.accepts_token(kToken, kNow + 9));
  EXPECT_FALSE(list_.accepts_token(kToken, kNow + 10));
  EXPECT_TRUE(list_.accepts_certificate(std::string(64, 'c'), kNow));
  EXPECT_FALSE(list_.accepts_certificate(std::string(64, 'c'), kNow + 10));
  EXPECT_FALSE(list_.accepts_certificate("", kNow)) << "an empty digest matches no entry without a certificate";
  EXPECT_FALSE(list_.accepts_certificate(std::string(64, 'd'), kNow));
}

TEST_F(ClientListTest, StoresNoTokens) {
  add(kToken, kNow + 10);
  EXPECT_THAT(**read_private_file(path_), ::testing::Not(HasSubstr(kToken)));
  EXPECT_EQ(mode_of(path_), 0600U);
}

TEST_F(ClientListTest, RejectsMalformedTokens) {
  add(kToken, kNow + 10);
  // Includes the placeholder that is hashed in place of a token of another length.
  for (const std::string& bad :
       {std::string(), std::string(kToken).substr(1), std::string(kToken) + "x", std::string(kTokenLength, '.'),
        std::string(kTokenLength, '\0'), std::string(100'000, 'x')})
    EXPECT_FALSE(list_.accepts_token(bad, kNow)) << bad.size();
}

TEST_F(ClientListTest, AnInvalidLineIsNamedAndCountedAndThePreviousListStays) {
  add(kToken, kNow + 10);
  ASSERT_TRUE(list_.accepts_token(kToken, kNow));
  EXPECT_EQ(list_.error_message(), "");
  const std::string newcomer(kTokenLength, 'n');
  std::uint64_t faults = 0;
  const std::string good = **read_private_file(path_), digest(64, 'a');
  for (const std::string& bad : {std::string("x"), digest, digest + " x 5", digest + " - tomorrow", digest + " - 5x",
                                 std::string(64, 'G') + " - 5", digest + " - 99999999999999999999"}) {
    ASSERT_TRUE(
        write_atomically(path_, good + bad + "\n" + to_hex(sha256(newcomer)) + " - 9999999999 new\n", FileMode::owner)
            .ok());
    EXPECT_TRUE(list_.accepts_token(kToken, kNow)) << bad;
    EXPECT_FALSE(list_.accepts_token(newcomer, kNow)) << "no line of an invalid file takes effect";
    EXPECT_THAT(list_.error_message(), AllOf(HasSubstr(path_ + ":4: "), HasSubstr("correct or delete the line")));
    EXPECT_EQ(list_.faults(), ++faults);
    const Status s = ClientList(path_).load();
    EXPECT_EQ(s.code(), StatusCode::data_loss);
    EXPECT_THAT(s.message(), HasSubstr(path_ + ":4: "));
  }
  ASSERT_TRUE(write_atomically(path_, good, FileMode::owner).ok());
  EXPECT_TRUE(list_.accepts_token(kToken, kNow)) << "the repaired file takes effect";
  EXPECT_EQ(list_.error_message(), "");
  EXPECT_EQ(list_.faults(), faults);
}

TEST_F(ClientListTest, AcceptsNobodyWithoutAValidList) {
  ASSERT_TRUE(write_atomically(path_, to_hex(sha256(kToken)) + " - 9999999999 x\nx\n", FileMode::owner).ok());
  EXPECT_FALSE(list_.accepts_token(kToken, kNow));
  EXPECT_EQ(list_.faults(), 1U);
}

TEST_F(ClientListTest, ExpiredClientsAreRemovedAndTheSizeIsLimited) {
  for (int i = 0; i < 256; ++i) add(std::to_string(i), kNow + (i == 0 ? 0 : 10));
  add(kToken, kNow + 10);  // Replaces the first one, which has expired.
  const Status s = ClientList::add(path_, {std::string(64, 'a'), "", kNow + 10, "x"}, kNow);
  EXPECT_EQ(s.code(), StatusCode::resource_exhausted);
  EXPECT_THAT(s.message(), HasSubstr("256"));
  EXPECT_TRUE(list_.accepts_token(kToken, kNow));
}

}  // namespace
}  // namespace lightwell::test
