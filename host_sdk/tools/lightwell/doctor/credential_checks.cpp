// The store of `lightwell pair`: permissions and validity.
#include <algorithm>
#include <ctime>
#include <filesystem>
#include <system_error>

#include <lightwell/files.hpp>
#include <lightwell/secrets.hpp>
#include <lightwell/text.hpp>

#include "core/credential_store.hpp"
#include "core/uri.hpp"
#include "doctor/machine_checks.hpp"
#include "doctor/probe_checks.hpp"

namespace lightwell::tool {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kDay_s = 86'400, kRenewal_s = 30 * kDay_s;

constexpr fs::perms kOthers = fs::perms::group_all | fs::perms::others_all;
constexpr fs::perms kOthersWrite = fs::perms::group_write | fs::perms::others_write;

/// Whether the file or folder has one of these permissions.
bool permits(const fs::path& path, fs::perms mask) {
  std::error_code error;
  const fs::perms mode = fs::status(path, error).permissions();
  return !error && (mode & mask) != fs::perms::none;
}

/// Of one certificate file; ok() without text if there is no such file, because a probe may not need it.
Finding check_certificate(const fs::path& file, std::int64_t now_s) {
  const std::string path = text_of(file);
  const Result<std::optional<std::string>> text = read_named_file(path);
  if (!text.ok()) return fault(text.status().message(), "pair with the probe again (`lightwell pair`)");
  if (!*text) return ok({});
  const Result<CertificateIdentity> certificate = identify_certificate(**text);
  if (!certificate.ok())
    return fault(path + " is no certificate", "delete the folder, and pair with the probe again (`lightwell pair`)");
  const std::int64_t left_s = certificate->expires_s - now_s;
  if (!certificate->is_in_date && left_s > 0)
    return fault(path + " is not valid yet",
                 "is this machine's date right? Then that of the machine that made it is not");
  if (!certificate->is_in_date)
    return fault(path + " has expired", "pair with the probe again: `lightwelld --pair` there, `lightwell pair` here");
  const auto days = static_cast<long long>(left_s / kDay_s);
  if (left_s < kRenewal_s)
    return warning(formatted("%s expires in %lld days", path.c_str(), days),
                   "pair with the probe again before that: `lightwelld --pair` there, `lightwell pair` here");
  return ok(formatted("%lld days", days));
}

/// The worse of two findings.
void add(Finding& all, Finding one) {
  if (one.verdict > all.verdict) all = std::move(one);
}

Finding check_folder(const fs::path& folder, std::int64_t now_s) {
  Finding all = ok({});
  // `lightwell pair` makes the folder for its owner alone, so that the modes of the files do not matter.
  if (permits(folder, kOthers))
    add(all, fault("other users of this machine may enter " + text_of(folder),
                   "`chmod -R go= " + text_of(folder) + "`; if others use this machine, also pair again"));
  for (const char* name : {"client.pem", "probe_ca.pem"}) add(all, check_certificate(folder / name, now_s));
  return all;
}

const char* const kPair = "pair with the probe: `lightwelld --pair` there, `lightwell pair` here";

/// For the addresses with credentials of pairing.
template <class Address>
Finding check_lookup(const ProbeCredentials& given, const Address& address) {
  if (address.transport == core::Transport::plain && given.empty())
    return not_checked("not needed: this address does not use TLS");
  const Result<ProbeCredentials> found = core::credentials_for(given, address);
  if (!found.ok()) return fault(found.status().message(), kPair);
  if (found->token.empty() && found->client_certificate.empty())
    return warning("a certificate of the probe, and nothing that identifies this client", kPair);
  return ok("this client has credentials for it");
}
Finding check_lookup(const ProbeCredentials&, const core::ReplayPath&) {
  return not_checked("not needed: a recording");
}
Finding check_lookup(const ProbeCredentials&, const core::UsbAddress&) { return not_checked("not needed by USB"); }
Finding check_lookup(const ProbeCredentials&, const MqttAddress&) {
  return not_checked(
      "those of a broker are in the environment variables LIGHTWELL_MQTT_CA, _CERTIFICATE, _KEY, _LOGIN");
}

}  // namespace

Finding check_credentials(const std::string& uri, const ProbeCredentials& given) {
  const Result<core::ProbeUri> address = core::parse_probe_uri(uri);
  if (!address.ok()) return fault(address.status().message(), "see `lightwell --help` for addresses");
  return std::visit([&](const auto& a) { return check_lookup(given, a); }, *address);
}

Finding check_credential_store(const std::string& store) {
  std::error_code error;
  std::vector<fs::path> folders;
  for (fs::directory_iterator it(path_of(store), error), end; !error && it != end; it.increment(error))
    if (it->is_directory(error) && !text_of(it->path().filename()).starts_with('.')) folders.push_back(it->path());
  if (error && error != std::errc::no_such_file_or_directory)
    return fault(store + ": " + error.message(), "give this user the access to it");
  if (folders.empty())
    return not_checked("no probe is paired with this user",
                       "only probes with TLS need it: `lightwelld --pair` there, `lightwell pair` here");
  Finding all = ok(formatted("%zu paired, in %s", folders.size(), store.c_str()));
  if (permits(path_of(store), kOthersWrite))
    add(all, fault("other users of this machine may write in " + store, "`chmod go-w " + store + "`"));
  std::ranges::sort(folders);
  for (const fs::path& folder : folders) add(all, check_folder(folder, std::time(nullptr)));
  return all;
}

}  // namespace lightwell::tool
