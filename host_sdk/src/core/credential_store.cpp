#include "core/credential_store.hpp"

#include <algorithm>
#include <filesystem>
#include <optional>
#include <system_error>
#include <utility>
#include <vector>

#include <lightwell/files.hpp>
#include <lightwell/secrets.hpp>

namespace lightwell::core {
namespace {

namespace fs = std::filesystem;

constexpr const char* kPinned = "probe_ca.pem";
constexpr const char* kClientCertificate = "client.pem";
constexpr const char* kClientKey = "client_key.pem";
constexpr const char* kToken = "token";
constexpr const char* kName = "name";
constexpr const char* kAddress = "address";
constexpr const char* kHost = "host";

/// Without white space at the ends, which editors may add.
std::string first_line(const std::string& text) { return text.substr(0, text.find_first_of("\r\n")); }

/// First line of a file; empty if it cannot be read.
std::string line_of(const fs::path& path) {
  const Result<std::optional<std::string>> text = read_named_file(text_of(path));
  return text.ok() && *text ? first_line(**text) : std::string();
}

Result<ProbeCredentials> read_folder(const fs::path& folder) {
  ProbeCredentials out;
  for (const auto& [name, into] :
       {std::pair(kPinned, &out.pinned), std::pair(kClientCertificate, &out.client_certificate),
        std::pair(kClientKey, &out.client_key), std::pair(kToken, &out.token)}) {
    Result<std::optional<std::string>> text = read_named_file(text_of(folder / name));
    if (!text.ok()) return text.status();
    if (*text) *into = std::move(**text);
  }
  out.token = first_line(out.token);
  if (out.pinned.empty())
    return Status(StatusCode::not_found,
                  text_of(folder / kPinned) + ": there is no such file; `lightwell pair` writes it");
  if (const Status s = out.validate(); !s.ok())
    return Status(StatusCode::data_loss, text_of(folder) + ": " + s.message());
  return out;
}

std::vector<fs::path> folders_of(const std::string& store) {
  std::vector<fs::path> out;
  std::error_code error;
  for (fs::directory_iterator it(path_of(store), error), end; !error && it != end; it.increment(error))
    if (it->is_directory(error) && !text_of(it->path().filename()).starts_with('.')) out.push_back(it->path());
  std::sort(out.begin(), out.end());
  return out;
}

/// Which part of a stored address must be that of the probe.
enum class Match { host_and_port, host };

Result<ProbeCredentials> look_up(const std::string& host_port, Match match) {
  const std::string store = default_credential_store();
  const std::vector<fs::path> folders = folders_of(store);
  const auto matched = [match](const std::string& address) {
    return match == Match::host ? address.substr(0, address.rfind(':')) : address;
  };
  for (const fs::path& folder : folders)
    if (matched(line_of(folder / kAddress)) == matched(host_port)) return read_folder(folder);
  if (folders.size() == 1) return read_folder(folders.front());
  std::string known;
  for (const fs::path& folder : folders)
    known += (known.empty() ? "" : ", ") + line_of(folder / kName) + " (" + text_of(folder) + ")";
  return Status(StatusCode::not_found,
                known.empty() ? "no credentials in " + store +
                                    ": pair with the probe (`lightwelld --pair` there, `lightwell pair` here)"
                              : "none of the paired probes has this address: give its folder as "
                                "credentials; there are " +
                                    known);
}

Result<ProbeCredentials> select_credentials(const ProbeCredentials& given, const std::string& host_port,
                                            Transport transport, const char* tls_scheme, Match match) {
  if (transport == Transport::plain) {
    if (given.empty()) return given;
    return Status(StatusCode::invalid_argument, std::string("credentials are not sent in plain text; use ") +
                                                    tls_scheme + host_port + " for the same probe over TLS");
  }
  if (!given.folder.empty()) return read_folder(path_of(given.folder));
  return given.empty() ? look_up(host_port, match) : Result<ProbeCredentials>(given);
}

/// The host name in the probe's certificate, for clients that can verify names but not pinned keys.
std::string host_named_by(const std::string& pinned) {
  const Result<CertificateIdentity> identity = identify_certificate(pinned);
  if (!identity.ok()) return {};
  if (identity->host.empty()) return kProbeHostName;
  const bool any_label = identity->host.starts_with("*.");
  return any_label ? "probe" + identity->host.substr(1) : identity->host;
}

/// Writes the files into a new folder that only its owner can access.
Status write_files(const fs::path& folder, const PairedFiles& files) {
  const ProbeCredentials& c = files.credentials;
  for (const auto& [file, text] :
       {std::pair(kPinned, c.pinned), std::pair(kClientCertificate, c.client_certificate),
        std::pair(kClientKey, c.client_key), std::pair(kToken, c.token), std::pair(kName, files.name),
        std::pair(kAddress, files.address), std::pair(kHost, host_named_by(c.pinned))}) {
    if (text.empty()) continue;
    const std::string line = text.ends_with('\n') ? text : text + "\n";
    if (Status s = write_atomically(text_of(folder / file), line, FileMode::owner); !s.ok()) return s;
  }
  return {};
}

}  // namespace

Result<ProbeCredentials> credentials_for(const ProbeCredentials& given, const GrpcAddress& address) {
  return select_credentials(given, address.host_port, address.transport, "grpcs://", Match::host_and_port);
}

Result<ProbeCredentials> credentials_for(const ProbeCredentials& given, const WebAddress& address) {
  return select_credentials(given, address.host_port, address.transport, "wss://", Match::host);
}

Result<std::string> keep_credentials(const std::string& store, const PairedFiles& files) {
  const Result<std::string> digest = certificate_digest(files.credentials.pinned);
  if (!digest.ok()) return digest.status();
  std::error_code error;
  fs::create_directories(path_of(store), error);
  if (error) return Status(StatusCode::failed_precondition, store + ": cannot be created: " + error.message());
  const fs::path folder = path_of(store) / to_hex(*digest).substr(0, 16);
  const Result<std::string> made = make_folder_beside(text_of(folder));
  if (!made.ok()) return made.status();
  Status kept = write_files(path_of(*made), files);
  if (kept.ok()) kept = replace_folder(*made, text_of(folder));
  if (!kept.ok()) {
    fs::remove_all(path_of(*made), error);
    return kept;
  }
  for (const fs::path& other : folders_of(store))
    if (other != folder && !files.address.empty() && line_of(other / kAddress) == files.address)
      fs::remove(other / kAddress, error);
  return text_of(folder);
}

}  // namespace lightwell::core
