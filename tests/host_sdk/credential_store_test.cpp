// The client's credential store.
#include "core/credential_store.hpp"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <unistd.h>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/syscall.h>

#include <lightwell/secrets.hpp>

#include "support/temp_dir.hpp"

namespace {
/// Paths of files and folders that were synced since the last clear. Null: not recorded.
std::vector<std::string>* flushed = nullptr;
}  // namespace

/// Replaces the C library's function.
extern "C" int fsync(int descriptor) {
  if (flushed != nullptr)
    flushed->push_back(std::filesystem::read_symlink("/proc/self/fd/" + std::to_string(descriptor)).string());
  return static_cast<int>(::syscall(SYS_fsync, descriptor));
}

namespace lightwell::core {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

/// Certificates of two probes' authorities: self-signed, generated with OpenSSL; the keys are not kept.
constexpr const char* kAttic =
    "-----BEGIN CERTIFICATE-----\n"
    "MIIBdjCCAR2gAwIBAgIUNxODX3IwyoM4YTdiaoBey1vSZ7owCgYIKoZIzj0EAwIw\n"
    "EDEOMAwGA1UEAwwFQVRUSUMwIBcNMjYxMTIxMjIxMDE2WhgPMjA1NDA0MDgyMjEw\n"
    "MTZaMBAxDjAMBgNVBAMMBUFUVElDMFkwEwYHKoZIzj0CAQYIKoZIzj0DAQcDQgAE\n"
    "OytM7VyKH1XgRY9uB03b7uHp06+f5x/OMEOQorhwA+N0Dyqj9iw4FIw86sVZosuc\n"
    "ssF9gyva9PNnmJ2IYZ/vraNTMFEwHQYDVR0OBBYEFH9MvO7DF9FvNV7fBAHHokh/\n"
    "t4DAMB8GA1UdIwQYMBaAFH9MvO7DF9FvNV7fBAHHokh/t4DAMA8GA1UdEwEB/wQF\n"
    "MAMBAf8wCgYIKoZIzj0EAwIDRwAwRAIgPZC0FNRt4LZU1o1jPg4gi9B6qKDAvOag\n"
    "l/KGXGcBbcACIGVYBfswFTtxllcDYfo5rRPbfxeHRGXFHttBMkGY/8n/\n"
    "-----END CERTIFICATE-----\n";
constexpr const char* kCellar =
    "-----BEGIN CERTIFICATE-----\n"
    "MIIBeTCCAR+gAwIBAgIUX398jTDfa3eh5wboetPATcweOFQwCgYIKoZIzj0EAwIw\n"
    "ETEPMA0GA1UEAwwGQ0VMTEFSMCAXDTI2MTEyMTIyMTAxNloYDzIwNTQwNDA4MjIx\n"
    "MDE2WjARMQ8wDQYDVQQDDAZDRUxMQVIwWTATBgcqhkjOPQIBBggqhkjOPQMBBwNC\n"
    "AAS0zFjttKY8HdjgS/AmPSIAkcPGup+c7/MYYWDpriAJMzPrhQQYASbMgCH9e/P7\n"
    "7cKpqg/qD770MeVyMWlzT4nno1MwUTAdBgNVHQ4EFgQUPiKXb4l+fQ41hibH28Jf\n"
    "+Xnm2XcwHwYDVR0jBBgwFoAUPiKXb4l+fQ41hibH28Jf+Xnm2XcwDwYDVR0TAQH/\n"
    "BAUwAwEB/zAKBggqhkjOPQQDAgNIADBFAiEAxVmk5pkG5s4F9gEOTbtQgE6fl8zL\n"
    "iLV/Q7rzyvQcBLQCIBni/0ILOBSWVhy8RFziFMq0Y6PzQvy6JeMNl210nbpE\n"
    "-----END CERTIFICATE-----\n";

PairedFiles files_of(const char* authority, const std::string& name, const std::string& address) {
  PairedFiles f;
  f.credentials.pinned = authority;
  f.credentials.client_certificate = authority;  // Any certificate; it is not used in a handshake here.
  f.credentials.client_key = "-----BEGIN PRIVATE KEY-----\n";
  f.credentials.token = "token-of-" + name;
  f.name = name;
  f.address = address;
  return f;
}

class CredentialStore : public ::testing::Test {
 protected:
  CredentialStore() { ::setenv("XDG_CONFIG_HOME", folder_.path("config").c_str(), 1); }
  ~CredentialStore() override { ::unsetenv("XDG_CONFIG_HOME"); }

  std::string keep(const PairedFiles& files) const {
    const Result<std::string> folder = keep_credentials(default_credential_store(), files);
    EXPECT_TRUE(folder.ok()) << folder.status().message();
    return folder.ok() ? *folder : std::string();
  }
  static std::string token_for(const std::string& host_port) {
    const Result<ProbeCredentials> found = credentials_for({}, GrpcAddress{host_port, Transport::tls});
    return found.ok() ? found->token : "none: " + found.status().message();
  }
  test::TempDir folder_;
};

TEST_F(CredentialStore, AProbeIsFoundByItsAddress) {
  keep(files_of(kAttic, "attic", "attic:7420"));
  keep(files_of(kCellar, "cellar", "[::1]:7420"));
  EXPECT_EQ(token_for("attic:7420"), "token-of-attic");
  EXPECT_EQ(token_for("[::1]:7420"), "token-of-cellar");
  EXPECT_THAT(token_for("10.0.0.9:7420"), AllOf(HasSubstr("attic ("), HasSubstr("cellar ("), HasSubstr("credentials")));
}

TEST_F(CredentialStore, AWebLinkIsFoundByItsHost) {
  keep(files_of(kAttic, "attic", "attic:7420"));
  keep(files_of(kCellar, "cellar", "[::1]:7420"));
  const auto token_of = [](const std::string& host_port) {
    return credentials_for({}, WebAddress{host_port, Transport::tls})->token;
  };
  EXPECT_EQ(token_of("attic:7443"), "token-of-attic");
  EXPECT_EQ(token_of("[::1]:7443"), "token-of-cellar");
  EXPECT_FALSE(credentials_for({}, WebAddress{"attic2:7443", Transport::tls}).ok());
}

TEST_F(CredentialStore, SingleStoredProbeMatchesAnyAddress) {
  EXPECT_THAT(token_for("attic:7420"), AllOf(HasSubstr("lightwell pair"), HasSubstr(folder_.path("config"))));
  keep(files_of(kAttic, "attic", "attic:7420"));
  EXPECT_EQ(token_for("10.0.0.9:7420"), "token-of-attic") << "the TLS handshake verifies the probe's certificate";
}

TEST_F(CredentialStore, PairingAgainReplacesTheCredentials) {
  const std::string first = keep(files_of(kAttic, "attic", "attic:7420"));
  PairedFiles again = files_of(kAttic, "attic", "attic:7420");
  again.credentials.token = "a-new-one";
  EXPECT_EQ(keep(again), first);
  EXPECT_EQ(token_for("attic:7420"), "a-new-one");
  for (const auto& entry : std::filesystem::directory_iterator(default_credential_store()))
    EXPECT_EQ(entry.path().string(), first) << "nothing is left beside it";
}

/// A power failure cannot be tested; the test checks that each step is synced before the next.
TEST_F(CredentialStore, OutlastsAPowerCut) {
  namespace fs = std::filesystem;
  for (const char* round : {"the first", "the second, over the first"}) {
    std::vector<std::string> paths;
    flushed = &paths;
    const std::string folder = keep(files_of(kAttic, "attic", "attic:7420"));
    flushed = nullptr;
    ASSERT_FALSE(paths.empty()) << round;
    EXPECT_EQ(paths.back(), fs::canonical(default_credential_store())) << round << ": the folder's name comes last";
    const std::string made = fs::path(paths.front()).parent_path();
    EXPECT_EQ(std::count(paths.begin(), paths.end(), made), 7) << round << ": the name of each file";
    for (const auto& entry : fs::directory_iterator(folder)) {
      // Under its temporary name.
      const std::string name = entry.path().filename();
      EXPECT_TRUE(std::any_of(paths.begin(), paths.end(),
                              [&](const std::string& path) { return path.starts_with(made + "/." + name + "."); }))
          << round << ": " << name;
    }
  }
}

TEST_F(CredentialStore, FifoIsRejectedByName) {
  ProbeCredentials given;
  given.folder = keep(files_of(kAttic, "attic", "attic:7420"));
  const std::string token = given.folder + "/token";
  std::filesystem::remove(token);
  ASSERT_EQ(::mkfifo(token.c_str(), 0600), 0);
  EXPECT_THAT(credentials_for(given, GrpcAddress{"attic:7420", Transport::tls}).status().message(), HasSubstr(token));
}

TEST_F(CredentialStore, AnAddressBelongsToTheLastPairedProbe) {
  keep(files_of(kAttic, "attic", "10.0.0.9:7420"));
  keep(files_of(kCellar, "cellar", "10.0.0.9:7420"));
  EXPECT_EQ(token_for("10.0.0.9:7420"), "token-of-cellar");
  keep(files_of(kAttic, "attic", "10.0.0.9:7420"));
  EXPECT_EQ(token_for("10.0.0.9:7420"), "token-of-attic");
}

TEST_F(CredentialStore, IsAccessibleToItsOwnerOnly) {
  namespace fs = std::filesystem;
  const std::string folder = keep(files_of(kAttic, "attic", "attic:7420"));
  EXPECT_EQ(fs::status(folder).permissions(), fs::perms::owner_all);
  int files = 0;
  for (const auto& entry : fs::directory_iterator(folder)) {
    ++files;
    EXPECT_EQ(entry.status().permissions(), fs::perms::owner_read | fs::perms::owner_write) << entry.path();
  }
  EXPECT_EQ(files, 7);
}

TEST_F(CredentialStore, StoresTheHostNameOfTheCertificate) {
  const std::string folder = keep(files_of(kAttic, "attic", "attic:7420"));
  std::ifstream file(folder + "/host");
  std::string host;
  EXPECT_TRUE(std::getline(file, host));
  EXPECT_EQ(host, kProbeHostName) << "an authority's: the one that probes' certificates bear";
}

TEST_F(CredentialStore, IncompleteFolderIsNamed) {
  const std::string folder = keep(files_of(kAttic, "attic", "attic:7420"));
  ProbeCredentials given;
  given.folder = folder;
  const GrpcAddress address{"10.0.0.9:7420", Transport::tls};
  ASSERT_TRUE(credentials_for(given, address).ok());
  std::filesystem::remove(folder + "/client_key.pem");
  EXPECT_EQ(credentials_for(given, address).status().code(), StatusCode::data_loss);
  std::filesystem::remove(folder + "/probe_ca.pem");
  EXPECT_THAT(credentials_for(given, address).status().message(), HasSubstr(folder + "/probe_ca.pem"));
}

TEST_F(CredentialStore, CredentialsAreNotSentInPlainText) {
  ProbeCredentials given;
  EXPECT_TRUE(credentials_for(given, GrpcAddress{"attic:7420", Transport::plain}).ok());
  given.token = "x";
  const Status s = credentials_for(given, GrpcAddress{"attic:7420", Transport::plain}).status();
  EXPECT_EQ(s.code(), StatusCode::invalid_argument);
  EXPECT_THAT(s.message(), HasSubstr("grpcs://attic:7420"));
}

TEST(ProbeCredentials, RejectsContradictoryFields) {
  EXPECT_TRUE(ProbeCredentials{}.validate().ok());
  const auto refusal = [](const ProbeCredentials& c) { return c.validate().message(); };
  ProbeCredentials c;
  c.token = "x";
  EXPECT_THAT(refusal(c), HasSubstr("pinned and ca")) << "a token for whom?";
  c.pinned = c.ca = kAttic;
  EXPECT_THAT(refusal(c), HasSubstr("pinned and ca"));
  c.ca.clear();
  EXPECT_TRUE(c.validate().ok());
  c.client_key = "x";
  EXPECT_THAT(refusal(c), HasSubstr("client_key"));
  c.client_key.clear();
  c.pinned = "a path, taken for the file's text";
  EXPECT_THAT(refusal(c), HasSubstr("pinned"));
  c.pinned = kAttic;
  c.token = "two words";
  EXPECT_THAT(refusal(c), HasSubstr("token"));
  c = {};
  c.folder = "x";
  c.token = "y";
  EXPECT_THAT(refusal(c), HasSubstr("folder"));
}

}  // namespace
}  // namespace lightwell::core
