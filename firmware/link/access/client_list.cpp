#include "link/access/client_list.hpp"

#include <algorithm>
#include <optional>
#include <sstream>

#include <sys/stat.h>

#include <lightwell/files.hpp>
#include <lightwell/secrets.hpp>
#include <lightwell/text.hpp>

namespace lightwell {
namespace {

constexpr std::size_t kMaxClients = 256;
constexpr std::size_t kDigestLength = 64;
constexpr const char* kHeading =
    "# Clients of this probe: SHA-256 of token, SHA-256 of certificate, end (seconds since 1970), name.\n"
    "# To shut one out, delete its line; it counts at once.\n";

bool is_digest(std::string_view text) {
  return text.size() == kDigestLength && text.find_first_not_of("0123456789abcdef") == std::string_view::npos;
}

Status wrong(const std::string& path, std::size_t line, const char* what) {
  return {StatusCode::data_loss, path + ":" + std::to_string(line) + ": " + what + "; correct or delete the line"};
}

Result<std::vector<ClientEntry>> parse(const std::string& text, const std::string& path) {
  std::vector<ClientEntry> out;
  std::istringstream lines(text);
  std::string line;
  for (std::size_t number = 1; std::getline(lines, line); ++number) {
    if (line.empty() || line.front() == '#') continue;
    std::istringstream words(line);
    ClientEntry entry;
    std::string end;
    words >> entry.token_digest >> entry.certificate_digest >> end >> std::ws;
    std::getline(words, entry.name);
    if (!is_digest(entry.token_digest)) return wrong(path, number, "the first word is not a SHA-256 of a token");
    if (entry.certificate_digest == "-") entry.certificate_digest.clear();
    if (!entry.certificate_digest.empty() && !is_digest(entry.certificate_digest))
      return wrong(path, number, "the second word is neither - nor a SHA-256 of a certificate");
    const auto expires_s = parse_number<std::int64_t>(end);
    if (!expires_s) return wrong(path, number, "the third word is not a time in seconds since 1970");
    entry.expires_s = *expires_s;
    if (out.size() == kMaxClients) return wrong(path, number, "more than 256 clients");
    out.push_back(std::move(entry));
  }
  return out;
}

std::string line_of(const ClientEntry& e) {
  return e.token_digest + " " + (e.certificate_digest.empty() ? "-" : e.certificate_digest) + " " +
         std::to_string(e.expires_s) + " " + e.name + "\n";
}

Result<std::vector<ClientEntry>> read_entries(const std::string& path) {
  const Result<std::optional<std::string>> text = read_private_file(path);
  if (!text) return text.status();
  return *text ? parse(**text, path) : std::vector<ClientEntry>();
}

/// A fingerprint of the file that changes with its content, from stat() alone.
std::string state_of(const std::string& path) {
  struct stat s {};
  if (::stat(path.c_str(), &s) != 0) return "none";
  return std::to_string(s.st_ino) + " " + std::to_string(s.st_size) + " " + std::to_string(s.st_mtim.tv_sec) + "." +
         std::to_string(s.st_mtim.tv_nsec);
}

}  // namespace

Status ClientList::load() {
  const std::lock_guard lock(mutex_);
  file_state_ = state_of(path_);
  Result<std::vector<ClientEntry>> entries = read_entries(path_);
  entries_ = entries ? std::move(*entries) : std::vector<ClientEntry>();
  return entries.status();
}

void ClientList::refresh() {
  const std::string now = state_of(path_);
  if (now == file_state_) return;
  file_state_ = now;
  Result<std::vector<ClientEntry>> entries = read_entries(path_);
  error_message_.clear();
  if (entries) {
    entries_ = std::move(*entries);
    return;
  }
  ++faults_;
  error_message_ = entries.status().message() + " (until then the clients of the last valid list are accepted)";
}

std::string ClientList::error_message() {
  const std::lock_guard lock(mutex_);
  refresh();
  return error_message_;
}

std::uint64_t ClientList::faults() const {
  const std::lock_guard lock(mutex_);
  return faults_;
}

bool ClientList::accepts_token(std::string_view token, std::int64_t now_s) {
  // A text of another length is no token. An invalid token of the right length is hashed instead: the same time.
  static const std::string kNoToken(kTokenLength, '.');
  const std::string digest = to_hex(sha256(token.size() == kTokenLength ? token : std::string_view(kNoToken)));
  const std::lock_guard lock(mutex_);
  refresh();
  unsigned good = 0;
  for (const ClientEntry& e : entries_)
    good |= static_cast<unsigned>(same_secret(e.token_digest, digest)) & static_cast<unsigned>(now_s < e.expires_s);
  return good != 0;
}

bool ClientList::accepts_certificate(std::string_view digest, std::int64_t now_s) {
  const std::lock_guard lock(mutex_);
  refresh();
  return std::any_of(entries_.begin(), entries_.end(), [&](const ClientEntry& e) {
    return !e.certificate_digest.empty() && same_secret(e.certificate_digest, digest) && now_s < e.expires_s;
  });
}

Status ClientList::add(const std::string& path, ClientEntry entry, std::int64_t now_s) {
  Result<std::vector<ClientEntry>> entries = read_entries(path);
  if (!entries) return entries.status();
  std::erase_if(*entries, [&](const ClientEntry& e) { return e.expires_s <= now_s; });
  if (entries->size() >= kMaxClients)
    return {StatusCode::resource_exhausted, path + ": 256 clients are paired; delete the lines of unused ones"};
  // The name comes from the client: it must not contain a line break.
  entry.name = printable(entry.name.substr(0, 64));
  entries->push_back(std::move(entry));
  std::string text = kHeading;
  for (const ClientEntry& e : *entries) text += line_of(e);
  return write_atomically(path, text, FileMode::owner);
}

}  // namespace lightwell
